/**
 * Keeps files for use without a network, in a Cache of the browser with a limited size. The least recently used files
 * are dropped first. Sizes and times of use are in a ledger, since a Cache does not have them.
 */
import { fromText, keysToDrop, toText, type Use } from "./ledger";

const LIMIT_BYTES = 512 * 1024 * 1024;
/** Share of the kept bytes that stays after the browser has refused to store more. */
const KEPT_AT_REFUSAL = 0.5;
/** Pause before the ledger is written, ms, since more changes may follow. */
const SAVE_DELAY_MS = 300;

/** The body of a file; `range` is the Content-Range if it is a part of the file. */
export type Content = Readonly<{
  body: ArrayBuffer;
  type: string | null;
  range?: string | null;
}>;

const PART = "Content-Range";

async function sizeOf(cache: Cache, key: string): Promise<number> {
  return Number((await cache.match(key))?.headers.get("Content-Length") ?? 0);
}

export class Store {
  private saving: Promise<void> | null = null;

  private constructor(
    private readonly cache: Cache,
    private readonly ledgerKey: string,
    private readonly ledger: Map<string, Use>,
    private readonly limit_bytes: number,
  ) {}

  static async open(name: string, ledgerKey: string, limit_bytes = LIMIT_BYTES): Promise<Store> {
    const cache = await caches.open(name);
    const stored = fromText((await (await cache.match(ledgerKey))?.text()) ?? "");
    const ledger = new Map<string, Use>();
    for (const { url } of await cache.keys()) {
      if (url === ledgerKey) continue;
      // An entry that is missing in the ledger counts as old; its size is in its own headers.
      const bytes = stored.has(url) ? 0 : await sizeOf(cache, url);
      ledger.set(url, stored.get(url) ?? { bytes, used_ms: 0 });
    }
    return new Store(cache, ledgerKey, ledger, limit_bytes);
  }

  has(key: string): boolean {
    return this.ledger.has(key);
  }

  /** Returns a kept file, or a kept part of a file with status 206; null if it is not kept. */
  async get(key: string): Promise<Response | null> {
    const use = this.ledger.get(key);
    if (use === undefined) return null;
    const kept = await this.cache.match(key).catch(() => undefined);
    if (kept === undefined) {
      this.ledger.delete(key); // the browser has deleted the entry by itself
      return null;
    }
    this.ledger.set(key, { ...use, used_ms: Date.now() });
    if (!kept.headers.has(PART)) return kept;
    return new Response(kept.body, { status: 206, headers: kept.headers });
  }

  /** Keeps a file if there is room. If the browser refuses, that is not a fault; less works without a network then. */
  async put(key: string, { body, type, range }: Content): Promise<void> {
    const bytes = body.byteLength;
    if (bytes > this.limit_bytes) return;
    const headers = new Headers({ "Content-Length": String(bytes) });
    if (type !== null) headers.set("Content-Type", type);
    if (range !== undefined && range !== null) headers.set(PART, range); // a Cache refuses 206
    this.ledger.set(key, { bytes, used_ms: Date.now() });
    await this.drop(keysToDrop(this.ledger, this.limit_bytes));
    try {
      await this.cache.put(key, new Response(body, { headers }));
    } catch {
      this.ledger.delete(key);
      await this.freeSpace();
    }
  }

  /** Drops the entries under a prefix that are no longer wanted. */
  async retain(prefix: string, isWanted: (key: string) => boolean): Promise<void> {
    const keys = [...this.ledger.keys()];
    await this.drop(keys.filter((key) => key.startsWith(prefix) && !isWanted(key)));
  }

  /** Resolves once the ledger is written; calls shortly after one another share one write. */
  save(): Promise<void> {
    this.saving ??= new Promise((resolve) => setTimeout(resolve, SAVE_DELAY_MS))
      .then(() => {
        this.saving = null;
        return this.cache.put(this.ledgerKey, new Response(toText(this.ledger)));
      })
      .catch(() => undefined); // without the ledger, all entries count as old when the worker next starts
    return this.saving;
  }

  private async freeSpace(): Promise<void> {
    let held = 0;
    for (const { bytes } of this.ledger.values()) held += bytes;
    await this.drop(keysToDrop(this.ledger, KEPT_AT_REFUSAL * held));
  }

  private async drop(keys: readonly string[]): Promise<void> {
    for (const key of keys) {
      this.ledger.delete(key);
      await this.cache.delete(key).catch(() => false);
    }
  }
}
