import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Store } from "./store";

const LEDGER = "https://host/kept/ledger";
const KEY = (name: string) => `https://host/kept/${name}`;

/** A Cache in memory, with room for `room.bytes` bytes. */
function fakeCache(room: { bytes: number }) {
  const entries = new Map<string, { body: ArrayBuffer; headers: Headers }>();
  return {
    match: async (key: string) => {
      const entry = entries.get(key);
      return entry && new Response(entry.body.slice(0), { headers: entry.headers });
    },
    put: async (key: string, response: Response) => {
      const body = await response.arrayBuffer();
      if (key !== LEDGER && body.byteLength > room.bytes) throw new DOMException("full");
      entries.set(key, { body, headers: response.headers });
    },
    delete: async (key: string) => entries.delete(key),
    keys: async () => [...entries.keys()].map((url) => ({ url })),
  };
}

const content = (bytes: number, range: string | null = null) => ({
  body: new ArrayBuffer(bytes),
  type: "image/ktx2",
  range,
});

describe("the offline store", () => {
  const room = { bytes: Number.POSITIVE_INFINITY };

  beforeEach(() => {
    room.bytes = Number.POSITIVE_INFINITY;
    const cache = fakeCache(room);
    vi.stubGlobal("caches", { open: async () => cache });
    vi.useFakeTimers({ now: 1000 });
  });

  afterEach(() => {
    vi.unstubAllGlobals();
    vi.useRealTimers();
  });

  const openStore = (limit_bytes?: number) => Store.open("test", LEDGER, limit_bytes);

  it("returns what it keeps, and parts of files with status 206", async () => {
    const store = await openStore();
    await store.put(KEY("a"), content(5));
    await store.put(KEY("b"), content(3, "bytes 0-2/9"));
    const [a, b] = [await store.get(KEY("a")), await store.get(KEY("b"))];
    expect([a?.status, a?.headers.get("Content-Type")]).toEqual([200, "image/ktx2"]);
    expect([b?.status, b?.headers.get("Content-Range")]).toEqual([206, "bytes 0-2/9"]);
    expect((await b?.arrayBuffer())?.byteLength).toBe(3);
    expect(await store.get(KEY("c"))).toBeNull();
  });

  it("drops the least recently used entries, also after a restart", async () => {
    const first = await openStore(10);
    for (const name of ["a", "b", "c"]) {
      await first.put(KEY(name), content(3));
      vi.advanceTimersByTime(10);
    }
    await first.get(KEY("a"));
    const saved = first.save();
    await vi.advanceTimersByTimeAsync(1000);
    await saved;
    const second = await openStore(10);
    await second.put(KEY("d"), content(3));
    expect(["a", "b", "c", "d"].filter((name) => second.has(KEY(name)))).toEqual(["a", "c", "d"]);
    await second.put(KEY("e"), content(11)); // larger than the whole store
    expect(second.has(KEY("e"))).toBe(false);
    expect(second.has(KEY("d"))).toBe(true);
  });

  it("finds entries that are missing in the ledger, with their sizes", async () => {
    const first = await openStore(10);
    await first.put(KEY("a"), content(6)); // the worker stops before it writes the ledger
    const second = await openStore(10);
    await second.put(KEY("b"), content(6));
    expect([second.has(KEY("a")), second.has(KEY("b"))]).toEqual([false, true]);
  });

  it("makes room if the browser refuses to store more, and continues", async () => {
    const store = await openStore();
    await store.put(KEY("a"), content(3));
    vi.advanceTimersByTime(10);
    await store.put(KEY("b"), content(3));
    room.bytes = 1;
    await store.put(KEY("c"), content(3));
    expect(["a", "b", "c"].filter((name) => store.has(KEY(name)))).toEqual(["b"]);
  });

  it("drops only unwanted entries under a prefix", async () => {
    const store = await openStore();
    for (const name of ["x/1", "x/2", "y/1"]) await store.put(KEY(name), content(1));
    await store.retain(KEY("x/"), (key) => key.endsWith("/2"));
    expect(["x/1", "x/2", "y/1"].filter((name) => store.has(KEY(name)))).toEqual(["x/2", "y/1"]);
  });
});
