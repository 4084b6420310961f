/**
 * Handles of dropped files and folders, kept by the browser: after a reload, an unfinished upload goes on by one click.
 * Some browsers have no handles, or keep nothing: then the same files are dropped again.
 */
const DATABASE = "stereocell-inbox";
const STORE = "handles";

/** Most handles that are kept of one item: the browser asks for the permission to read each of them. */
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

/** The items of which handles are kept. */
export async function keptItems(): Promise<readonly string[]> {
  return ((await ask("readonly", (store) => store.getAllKeys())) ?? []).map(String);
}

/**
 * The handles of an item, once the person has allowed this page to read them. Must be called from within a click.
 * Empty: there are none, or the person has refused.
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
