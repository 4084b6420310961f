import { beforeEach, expect, it, vi } from "vitest";
import { decodeTexels } from "../bundle/decode";
import type { TileVolume } from "../bundle/generated/volumes";
import type { LevelSource } from "../state/on_screen";
import { availableLevel, TexelCache } from "./texel_cache";

vi.mock("../bundle/decode", () => ({
  decodeTexels: vi.fn(async (frames: readonly { bytes: Uint8Array }[], bytes: number) =>
    new Uint8Array(bytes).fill(frames[0].bytes[0]),
  ),
}));

const MIB = 1024 * 1024;

function volumeOf(name: string, sides: readonly number[]): TileVolume {
  const file = { path: name, bytes: 0, sha256: "" };
  const levels = sides.map((n) => ({
    size: [n, n, n] as [number, number, number],
    offset: 0,
    length: 1,
    sha256: "",
  }));
  return {
    tile: "r0_c0",
    file,
    bricks: file,
    size: levels[0].size,
    apron: 1,
    bounds_um: { min: [0, 0, 0], max: [1, 1, 1] },
    matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    levels: [levels[0], ...levels.slice(1)],
  };
}

function sourceOf(volume: TileVolume, available: readonly number[]): LevelSource {
  return {
    volume,
    has: (index) => available.includes(index),
    level: async (index) => Uint8Array.of(index),
  };
}

const reopen = (volume: TileVolume) => sourceOf(volume, []);

beforeEach(() => {
  vi.mocked(decodeTexels).mockClear();
});

it("the cache of texels gives the finest available level that is small enough", async () => {
  const source = sourceOf(volumeOf("a", [64, 32, 16]), [2, 1]);
  expect(availableLevel(source)).toBe(1);
  expect(availableLevel(source, 5000)).toBe(2);
  expect(availableLevel(source, 5)).toBeNull();
  const cache = new TexelCache(reopen);
  expect((await cache.available(source))?.size).toEqual([32, 32, 32]);
  expect(await cache.available(source, 5)).toBeNull();
  expect(decodeTexels).toHaveBeenCalledTimes(1);
});

it("the cache of texels fetches a level of moderate size if none is available", async () => {
  const cache = new TexelCache(reopen);
  const level = await cache.best(sourceOf(volumeOf("a", [256, 128, 64]), []));
  expect(level.size).toEqual([128, 128, 128]);
  expect(level.texels[0]).toBe(1);
});

it("a repeatedly requested level is decoded only once, and the least recently used level is dropped", async () => {
  const cache = new TexelCache(reopen);
  const side = Math.cbrt(27 * MIB);
  const [a, b, c] = ["a", "b", "c"].map((name) => sourceOf(volumeOf(name, [side]), [0]));
  await Promise.all([cache.best(a), cache.best(a)]);
  await cache.best(b);
  await cache.best(a);
  expect(decodeTexels).toHaveBeenCalledTimes(2);
  await cache.best(c); // with 81 MiB in the cache, b is dropped
  await cache.best(a);
  expect(decodeTexels).toHaveBeenCalledTimes(3);
  await cache.best(b);
  expect(decodeTexels).toHaveBeenCalledTimes(4);
});

it("a level that failed to decode is tried again at the next request", async () => {
  const cache = new TexelCache(reopen);
  const source = sourceOf(volumeOf("a", [4]), [0]);
  vi.mocked(decodeTexels).mockRejectedValueOnce(new Error("broken"));
  await expect(cache.best(source)).rejects.toThrow("broken");
  expect((await cache.best(source)).size).toEqual([4, 4, 4]);
});
