/**
 * Cache of brick tables and bricks in the browser's database, under the hash of their content.
 * Without a database nothing is stored and nothing fails.
 */

const NAME = "stereocell-bricks";
const VERSION = 1;
/** Bytes. Beyond this size, the oldest tables and their bricks are deleted. */
const LIMIT_BYTES = 512 * 1024 * 1024;

export type KeptTable = Readonly<{
  /**
   * SHA-256 of the volume's file, and the channel: the functions of another channel leave out other
   * bricks.
   */
  volume: string;
  hash: string;
  bytes: Uint8Array<ArrayBuffer>;
  /** Bytes of its stored bricks. */
  brick_bytes: number;
  used_ms: number;
}>;
/** `table`: hash of the table to which the brick belongs. */
export type KeptBrick = Readonly<{
  hash: string;
  table: string;
  bytes: Uint8Array<ArrayBuffer>;
}>;

function resultOf<T>(request: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

function finished(work: IDBTransaction): Promise<void> {
  return new Promise((resolve, reject) => {
    work.oncomplete = () => resolve();
    work.onabort = work.onerror = () => reject(work.error);
  });
}

/** The keys of a table's bricks: in IndexedDB an array is greater than any text. */
function ofTable(table: string): IDBKeyRange {
  return IDBKeyRange.bound([table], [table, []]);
}

export class BrickCache {
  private constructor(private readonly database: IDBDatabase | null) {}

  static async open(): Promise<BrickCache> {
    try {
      const request = indexedDB.open(NAME, VERSION);
      request.onupgradeneeded = () => {
        request.result.createObjectStore("tables", { keyPath: "volume" });
        request.result.createObjectStore("bricks", { keyPath: ["table", "hash"] });
      };
      return new BrickCache(await resultOf(request));
    } catch {
      // there is no database in a private window, or if the browser forbids storage
      return new BrickCache(null);
    }
  }

  async table(volume: string): Promise<KeptTable | null> {
    return this.safely(null, async (database) => {
      const found = database.transaction("tables").objectStore("tables").get(volume);
      return ((await resultOf(found)) as KeptTable | undefined) ?? null;
    });
  }

  async bricks(table: string): Promise<readonly KeptBrick[]> {
    return this.safely([], (database) => {
      const bricks = database.transaction("bricks").objectStore("bricks");
      return resultOf(bricks.getAll(ofTable(table))) as Promise<KeptBrick[]>;
    });
  }

  async keepTable(volume: string, hash: string, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    await this.safely(undefined, async (database) => {
      const before = await this.table(volume);
      if (before !== null && before.hash !== hash) await this.forget(before);
      const brick_bytes = before?.hash === hash ? before.brick_bytes : 0;
      const work = database.transaction("tables", "readwrite");
      const kept: KeptTable = { volume, hash, bytes, brick_bytes, used_ms: Date.now() };
      work.objectStore("tables").put(kept);
      await finished(work);
    });
  }

  async keepBricks(volume: string, bricks: readonly KeptBrick[]): Promise<void> {
    await this.safely(undefined, async (database) => {
      const work = database.transaction(["tables", "bricks"], "readwrite");
      const tables = work.objectStore("tables");
      for (const brick of bricks) work.objectStore("bricks").put(brick);
      const table = (await resultOf(tables.get(volume))) as KeptTable | undefined;
      if (table !== undefined) {
        const more = bricks.reduce((sum, { bytes }) => sum + bytes.length, 0);
        tables.put({ ...table, brick_bytes: table.brick_bytes + more });
      }
      await finished(work);
      await this.freeSpace(volume);
    });
  }

  private async freeSpace(but: string): Promise<void> {
    const { database } = this;
    if (database === null) return;
    const tables = (await resultOf(
      database.transaction("tables").objectStore("tables").getAll(),
    )) as KeptTable[];
    let sum = tables.reduce((total, { brick_bytes }) => total + brick_bytes, 0);
    tables.sort((a, b) => a.used_ms - b.used_ms);
    for (const table of tables) {
      if (sum <= LIMIT_BYTES) return;
      if (table.volume === but) continue;
      await this.forget(table);
      sum -= table.brick_bytes;
    }
  }

  private async forget({ volume, hash }: KeptTable): Promise<void> {
    const { database } = this;
    if (database === null) return;
    const work = database.transaction(["tables", "bricks"], "readwrite");
    work.objectStore("tables").delete(volume);
    work.objectStore("bricks").delete(ofTable(hash));
    await finished(work);
  }

  /**
   * Runs a task on the database. Returns `none` if there is no database, or if it is full or was
   * removed.
   */
  private async safely<T>(none: T, work: (database: IDBDatabase) => Promise<T>): Promise<T> {
    if (this.database === null) return none;
    try {
      return await work(this.database);
    } catch (error) {
      if (error instanceof DOMException) return none;
      throw error;
    }
  }
}
