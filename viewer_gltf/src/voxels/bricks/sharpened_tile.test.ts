import { describe, expect, it } from "vitest";
import type { TileTexture } from "../tile_texture";
import type { VolumeSource } from "../volume_source";
import type { BrickTile } from "./brick_atlas";
import { SharpenedTile } from "./sharpened_tile";

const source = (finer: boolean) =>
  ({ volume: finer ? { finer_size: [64, 64, 64] } : {} }) as unknown as VolumeSource;
const SOURCES = new Map([["A", source(true)]]);

/** A texture that shows a level when the test says so. */
function texture() {
  const made = {
    shown: null as { level: number } | null,
    old: null,
    fresh: 1,
    bytes: 10,
    isLoading: true,
    isComplete: false,
    isDisposed: false,
    thresholds: [30],
    kept: new Map(),
    hasFailed: () => false,
    retryFailed: () => undefined,
    advance: () => false,
    want(sources: ReadonlyMap<string, VolumeSource>) {
      made.kept = new Map(sources);
    },
    show(level: number) {
      made.shown = { level };
      made.isLoading = false;
      made.isComplete = true;
    },
    dispose: () => {
      made.isDisposed = true;
    },
  };
  return made;
}

function setUp(sources = SOURCES) {
  const coarse = texture();
  const finer = [texture(), texture()];
  const asked: (() => void)[] = [];
  const make = (refuse: () => void) => {
    asked.push(refuse);
    return finer[asked.length - 1] as unknown as BrickTile;
  };
  const tile = new SharpenedTile(coarse as unknown as TileTexture, make, () => undefined);
  tile.want(sources, [0]);
  return { tile, coarse, finer, asked };
}

describe("a tile with finer volumes", () => {
  it("shows its files first, and the finer volumes when they are all loaded", () => {
    const { tile, coarse, finer } = setUp();
    expect(tile.canSharpen).toBe(false); // the files are loaded first
    coarse.show(0);
    expect(tile.canSharpen).toBe(true);
    tile.sharpen();
    expect([tile.canSharpen, tile.isLoading, tile.isSharpening]).toEqual([false, true, true]);
    finer[0].shown = { level: 3 };
    tile.advance(0.1);
    expect(tile.shown).toBe(coarse.shown);
    expect(tile.thresholds).toEqual([]);
    finer[0].show(0);
    tile.advance(0.1);
    expect(tile.shown).toBe(finer[0].shown);
    expect(tile.thresholds).toEqual([30]);
    expect(tile.isLoading).toBe(false);
    expect(tile.bytes).toBe(20);
  });

  it("shows its files if finer volumes are refused, and does not request them again", () => {
    const { tile, coarse, finer, asked } = setUp();
    coarse.show(0);
    tile.sharpen();
    asked[0]();
    expect(finer[0].isDisposed).toBe(true);
    expect([tile.canSharpen, tile.isLoading]).toEqual([false, false]);
    expect(tile.shown).toBe(coarse.shown);
  });

  it("shows its files when other channels are wanted, and sharpens them again", () => {
    const { tile, coarse, finer } = setUp();
    coarse.show(0);
    tile.sharpen();
    finer[0].show(0);
    tile.advance(0.1);
    tile.want(SOURCES, []); // the same channels, no new levels
    expect(tile.shown).toBe(finer[0].shown);
    tile.want(new Map([...SOURCES, ["B", source(true)]]), [0]);
    expect(finer[0].isDisposed).toBe(true);
    expect(tile.shown).toBe(coarse.shown);
    expect(tile.canSharpen).toBe(true);
    tile.sharpen();
    finer[1].show(1);
    tile.advance(0.1);
    expect(tile.shown).toBe(finer[1].shown);
    tile.dispose();
    expect([finer[1].isDisposed, coarse.isDisposed]).toEqual([true, true]);
  });
});

it("requests nothing if there is nothing finer", () => {
  const { tile, coarse } = setUp(new Map([["A", source(false)]]));
  coarse.show(0);
  expect(tile.canSharpen).toBe(false);
});
