import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Server } from "./server";
import { type Progress, Upload } from "./upload";
import { UploadFiles } from "./upload_files";

/** Bytes of a piece: the most that the server takes at once, and the least that a page sends. */
const PIECE = 2 ** 16;
const TOTAL = 5 * PIECE;

/** Lets work finish that waits for no timer. Reading a blob takes several turns of the event loop. */
async function rest(): Promise<void> {
  for (let i = 0; i < 20; i++) await new Promise((resolve) => setImmediate(resolve));
}

/** Lets time pass until a promise is settled. */
async function passUntil(settled: Promise<unknown>): Promise<void> {
  let isOver = false;
  void settled.then(() => {
    isOver = true;
  });
  while (!isOver) {
    await vi.advanceTimersByTimeAsync(500);
    await rest();
  }
}

/** Bytes of which neighbours differ, and bytes far apart, too, so that a wrong order is noticed. */
const CONTENT = new Uint8Array(TOTAL).map((_, i) => (i * 31 + (i >> 8) * 7) % 251);

function filesOf(content = CONTENT): UploadFiles {
  const parts = [0, 1000, 1000, 2 * PIECE + 5, content.length];
  return new UploadFiles(
    parts.slice(1).map((end, i) => ({
      name: `f/${i}`,
      file: new Blob([content.slice(parts[i], end)]),
    })),
  );
}

type Fault = "cut" | "lost" | "behind" | number;

/** A server that stores bytes like the real one. Each request gets the next fault; null: none. */
class Store {
  bytes = new Uint8Array(0);
  readonly requests: string[] = [];

  get isWhole(): boolean {
    return Buffer.compare(this.bytes, CONTENT) === 0;
  }

  constructor(readonly faults: (Fault | null)[] = []) {}

  readonly request = async (address: RequestInfo | URL, how: RequestInit = {}) => {
    how.signal?.throwIfAborted();
    const fault = this.faults.shift() ?? null;
    this.requests.push(`${how.method} ${new URL(String(address)).pathname}`);
    if (fault === "lost") throw new TypeError("Failed to fetch");
    if (typeof fault === "number") {
      return new Response(JSON.stringify({ line: "The disk is full." }), { status: fault });
    }
    if (fault === "behind") this.bytes = this.bytes.slice(0, 1000);
    if (how.method === "PATCH") {
      const offset = Number(new Headers(how.headers).get("Upload-Offset"));
      const body = new Uint8Array(await (how.body as Blob).arrayBuffer());
      if (offset !== this.bytes.length) return this.answer(409);
      const kept = fault === "cut" ? body.slice(0, body.length >> 1) : body;
      this.bytes = new Uint8Array(Buffer.concat([this.bytes, kept]));
      if (fault === "cut") throw new TypeError("Failed to fetch");
    }
    return this.answer(how.method === "PATCH" ? 204 : 200);
  };

  private answer(status: number): Response {
    const headers = { "Upload-Offset": String(this.bytes.length) };
    return new Response(null, { status, headers });
  }
}

describe("an upload", () => {
  beforeEach(() => void vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] }));
  afterEach(() => void vi.useRealTimers());

  function prepare(store: Store, offset = 0, files = filesOf()) {
    const reports: Progress[] = [];
    const server = new Server("http://localhost/", store.request as typeof fetch);
    const upload = new Upload("a1", files, offset, server, PIECE, (progress) =>
      reports.push(progress),
    );
    return { upload, reports };
  }

  async function finish(store: Store, offset = 0) {
    const { upload, reports } = prepare(store, offset);
    const run = upload.run();
    await passUntil(run);
    return reports;
  }

  const patches = (store: Store) => store.requests.filter((each) => each.startsWith("PATCH"));

  it("sends all bytes in order, in pieces of at most what the server takes", async () => {
    const store = new Store();
    const reports = await finish(store);
    expect(store.isWhole).toBe(true);
    expect(patches(store)).toHaveLength(5);
    expect(reports.at(-1)).toMatchObject({ doing: "complete", sent: TOTAL, total: TOTAL });
  });

  it("begins behind the bytes that the server already has, as after a reload", async () => {
    const store = new Store();
    store.bytes = CONTENT.slice(0, 3 * PIECE + 17);
    await finish(store, 3 * PIECE + 17);
    expect(store.isWhole).toBe(true);
    expect(patches(store)).toHaveLength(2);
  });

  it("goes on after lost connections from the bytes that have arrived", async () => {
    const store = new Store([null, "cut", "lost", "lost", null, "cut"]);
    const reports = await finish(store);
    expect(store.isWhole).toBe(true);
    expect(reports.some(({ doing }) => doing === "lost")).toBe(true);
    expect(store.requests.filter((each) => each.startsWith("HEAD"))).toHaveLength(4);
  });

  it("continues behind the bytes that the server has, even if they are fewer than were sent", async () => {
    const store = new Store([null, null, "behind"]);
    await finish(store);
    expect(store.isWhole).toBe(true);
  });

  it("waits while the server is busy or full, and shows the server's reason", async () => {
    const store = new Store([null, 507, 503]);
    const reports = await finish(store);
    expect(store.isWhole).toBe(true);
    expect(reports.find(({ doing }) => doing === "lost")?.line).toBe("The disk is full.");
  });

  it.each([403, 404, 413])("ends if the server refuses it for good: status %i", async (status) => {
    const store = new Store([null, status]);
    const reports = await finish(store);
    expect(reports.at(-1)).toMatchObject({ doing: "refused", line: "The disk is full." });
    expect(store.requests).toHaveLength(2);
  });

  it("waits longer after each lost request, and not at all if the user asks to try now", async () => {
    const store = new Store(["lost", "lost", "lost", "lost", "lost"]);
    const { upload } = prepare(store);
    const run = upload.run();
    await rest();
    const counts: number[] = [];
    for (const time_ms of [499, 1, 999, 1, 1999, 1]) {
      await vi.advanceTimersByTimeAsync(time_ms);
      await rest();
      counts.push(store.requests.length);
    }
    expect(counts).toEqual([1, 2, 2, 3, 3, 4]);
    upload.retryNow();
    await rest();
    expect(store.requests).toHaveLength(5);
    upload.retryNow();
    await passUntil(run);
    expect(store.isWhole).toBe(true);
  });

  it("stops at once when it is cancelled, even while it waits", async () => {
    const store = new Store([null, "lost"]);
    const { upload } = prepare(store);
    const run = upload.run();
    await rest();
    upload.cancel();
    await run;
    expect(upload.progress).toMatchObject({ doing: "cancelled", sent: PIECE });
    await vi.advanceTimersByTimeAsync(60_000);
    await rest();
    expect(store.requests).toHaveLength(2);
  });

  it("names a file that has changed since it was dropped", async () => {
    const gone = new Blob([CONTENT]);
    const unreadable = () => Promise.reject(new DOMException("changed", "NotReadableError"));
    gone.slice = () => Object.assign(new Blob([CONTENT]), { arrayBuffer: unreadable });
    const files = new UploadFiles([{ name: "f/a.dcm", file: gone }]);
    files.piece = () => gone.slice();
    const store = new Store();
    const { upload, reports } = prepare(store, 0, files);
    await upload.run();
    expect(store.requests).toEqual([]);
    expect(reports.at(-1)).toMatchObject({
      doing: "refused",
      line: "f/a.dcm has changed or is gone. Drop the files again.",
    });
  });
});
