/** The entries of the offline store, and the last use of each. Plain data. */

export type Use = Readonly<{ bytes: number; used_ms: number }>;
/** Uses by key, not in any order. */
export type Ledger = ReadonlyMap<string, Use>;

export function totalBytes(ledger: Ledger): number {
  let sum = 0;
  for (const { bytes } of ledger.values()) sum += bytes;
  return sum;
}

/** Returns the keys to drop so that at most `limit_bytes` are left; the least recently used come first. */
export function keysToDrop(ledger: Ledger, limit_bytes: number): string[] {
  let excess = totalBytes(ledger) - limit_bytes;
  const dropped: string[] = [];
  const oldest = [...ledger].sort(([, a], [, b]) => a.used_ms - b.used_ms);
  for (const [key, { bytes }] of oldest) {
    if (excess <= 0) break;
    dropped.push(key);
    excess -= bytes;
  }
  return dropped;
}

export function toText(ledger: Ledger): string {
  return JSON.stringify([...ledger].map(([key, { bytes, used_ms }]) => [key, bytes, used_ms]));
}

/** Reads a ledger. An unreadable text gives an empty one, and the store then lists its entries again. */
export function fromText(text: string): Map<string, Use> {
  try {
    const rows = JSON.parse(text) as [string, number, number][];
    return new Map(rows.map(([key, bytes, used_ms]) => [key, { bytes, used_ms }]));
  } catch {
    return new Map();
  }
}
