/**
 * Stores handles of dropped files and folders in the browser, so that an unfinished upload continues by one click after
 * a reload. Some browsers have no handles, or store nothing. Users then have to drop the same files again.
 */
const DATABASE = "stereocell-inbox";
const STORE = "handles";

/** Largest number of handles that are stored for an item; the browser asks for permission to read each of them. */
const MOST_HANDLES = 8;

type WithPermission = FileSystemHandle &
  Readonly<{ requestPermission?: (how: { mode: "read" }) => Promise<PermissionState> }>;

function openDatabase(): Promise<IDBDatabase> {
  return new Promise((resolve, reject) => {
    const request = indexedDB.open(DATABASE, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(STORE);
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

/** Returns the result of a request to the store; null: the browser keeps nothing. */
async function ask<T>(
  mode: IDBTransactionMode,
  request: (store: IDBObjectStore) => IDBRequest<T>,
): Promise<T | null> {
  try {
    const database = await openDatabase();
    try {
      const store = database.transaction(STORE, mode).objectStore(STORE);
      return await new Promise<T>((resolve, reject) => {
        const asked = request(store);
        asked.onsuccess = () => resolve(asked.result);
        asked.onerror = () => reject(asked.error);
      });
    } finally {
      database.close();
    }
  } catch {
    return null;
  }
}

export async function keepHandles(id: string, handles: readonly FileSystemHandle[]): Promise<void> {
  if (handles.length === 0 || handles.length > MOST_HANDLES) return;
  await ask("readwrite", (store) => store.put(handles, id));
}

export async function forgetHandles(id: string): Promise<void> {
  await ask("readwrite", (store) => store.delete(id));
}

/** Returns the IDs of the items that have stored handles. */
export async function keptItems(): Promise<readonly string[]> {
  return ((await ask("readonly", (store) => store.getAllKeys())) ?? []).map(String);
}

/**
 * Returns the handles of an item after the user has allowed this page to read them. Must be called from within a click.
 * Returns an empty list if there are none, or if the user refuses.
 */
export async function readableHandles(id: string): Promise<readonly FileSystemHandle[]> {
  const found = (await ask<unknown>("readonly", (store) => store.get(id))) ?? [];
  const handles = found as readonly WithPermission[];
  for (const handle of handles) {
    const allowed = (await handle.requestPermission?.({ mode: "read" })) ?? "granted";
    if (allowed !== "granted") return [];
  }
  return handles;
}
