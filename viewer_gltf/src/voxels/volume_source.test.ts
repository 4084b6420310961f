import { createHash } from "node:crypto";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { TileVolume } from "../bundle/generated/volumes";
import { VolumeSource } from "./volume_source";

const FILE = Uint8Array.from({ length: 100 }, (_, i) => i);
const hashOf = (bytes: Uint8Array) => createHash("sha256").update(bytes).digest("hex");

/** Level 0 is bytes 40 to 89, level 1 bytes 20 to 39. */
const VOLUME: TileVolume = {
  tile: "r0_c0",
  file: { path: "v.ktx2", bytes: FILE.length, sha256: hashOf(FILE) },
  bricks: { path: "b.ktx2", bytes: 0, sha256: "" },
  size: [8, 8, 8],
  apron: 1,
  bounds_um: { min: [0, 0, 0], max: [1, 1, 1] },
  matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
  levels: [
    { size: [8, 8, 8], offset: 40, length: 50, sha256: hashOf(FILE.subarray(40, 90)) },
    { size: [4, 4, 4], offset: 20, length: 20, sha256: hashOf(FILE.subarray(20, 40)) },
  ],
};

/** A host that supports ranges; it has `file` under every name. */
function serve(file: Uint8Array) {
  const fetched = vi.fn(async (_: string, { headers }: { headers: { Range: string } }) => {
    const [first, last] = headers.Range.replace("bytes=", "").split("-").map(Number);
    return new Response(Uint8Array.from(file.subarray(first, last + 1)), {
      status: 206,
      headers: { "Content-Range": `bytes ${first}-${last}/${file.length}` },
    });
  });
  vi.stubGlobal("fetch", fetched);
  return fetched;
}

describe("a level that is fetched by range", () => {
  const { signal } = new AbortController();
  const source = () => new VolumeSource("https://host/b/", VOLUME);

  beforeEach(() => void vi.stubGlobal("isSecureContext", true));
  afterEach(() => vi.unstubAllGlobals());

  it("is its part of the file and is fetched once", async () => {
    const fetched = serve(FILE);
    const volume = source();
    expect([...(await volume.level(1, signal))]).toEqual([...FILE.subarray(20, 40)]);
    await volume.level(1, signal);
    expect(fetched).toHaveBeenCalledTimes(1);
    expect([...(await volume.level(0, signal))]).toEqual([...FILE.subarray(40, 90)]);
  });

  it("is rejected if its bytes are wrong, but other levels are not", async () => {
    const damaged = FILE.slice();
    damaged[30] ^= 1;
    serve(damaged);
    const volume = source();
    const found = hashOf(damaged.subarray(20, 40));
    await expect(volume.level(1, signal)).rejects.toThrow(
      `v.ktx2: level 1: expected SHA-256 ${VOLUME.levels[1].sha256}, found ${found}`,
    );
    expect(volume.has(1)).toBe(false);
    expect(await volume.level(0, signal)).toHaveLength(50);
  });

  it("is fetched again past the caches if a cache has damaged it", async () => {
    const damaged = FILE.slice();
    damaged[30] ^= 1;
    const [old, fresh] = [serve(damaged), serve(FILE)];
    type Ask = Parameters<typeof fresh>[1] & { cache: RequestCache };
    const caches: RequestCache[] = [];
    vi.stubGlobal("fetch", (address: string, options: Ask) => {
      caches.push(options.cache);
      return options.cache === "reload" ? fresh(address, options) : old(address, options);
    });
    expect([...(await source().level(1, signal))]).toEqual([...FILE.subarray(20, 40)]);
    expect(caches).toEqual(["default", "reload"]);
  });

  it("is rejected if it is too short", async () => {
    serve(FILE.subarray(0, 70));
    await expect(source().level(0, signal)).rejects.toThrow("found 70 bytes, expected 100");
  });
});
