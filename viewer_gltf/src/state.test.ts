import { describe, expect, it } from "vitest";
import type { Manifest } from "./bundle/generated/bundle";
import {
  CHANNELS_AT_START,
  initialState,
  isSurfaceShown,
  MAX_VOLUME_CHANNELS,
  reduce,
  type ViewerState,
  volumeTiles,
} from "./state";

const FILE = { path: "x", bytes: 0, sha256: "0".repeat(64) };
const BOUNDS: Manifest["specimen"]["bounds_um"] = { min: [0, 0, 0], max: [3, 1, 1] };
const tile = (id: string, x: number): Manifest["tiles"][number] => ({
  id,
  bounds_um: { min: [x, 0, 0], max: [x + 1, 1, 1] },
});

function manifest(channels: number): Manifest {
  return {
    format: "stereocell-bundle",
    version: 1,
    generator: "test",
    specimen: { name: "test", bounds_um: BOUNDS },
    tiles: [tile("r0_c1", 1), tile("r0_c0", 0), tile("r0_c2", 2)],
    channels: Array.from({ length: channels }, (_, i) => ({
      id: `c${i}`,
      name: `channel ${i}`,
      color: [1, 0, 0],
      window: [0, 100],
      iso_value: 50,
      iso_normalized: 0.5,
      transfer_function: "default",
      transfer_functions: ["default", "soft"],
      lut: FILE,
      tileset: i === 1 ? null : FILE,
      triangles: [10, 5],
      volumes: FILE,
    })),
    files: FILE,
  };
}

function after(state: ViewerState, ...actions: Parameters<typeof reduce>[1][]): ViewerState {
  return actions.reduce(reduce, state);
}

describe("the viewer's state", () => {
  it("opens with surfaces of the first channels, no volume, the middle tile chosen", () => {
    const state = initialState(manifest(70));
    expect(state.channels.filter((c) => c.shown)).toHaveLength(CHANNELS_AT_START);
    expect(state.channels[1].hasSurface).toBe(false);
    expect(volumeTiles(state)).toEqual([]);
    expect(state.tile).toBe("r0_c1");
  });

  it("shows a volume in the chosen tile, or in all", () => {
    const on = reduce(initialState(manifest(2)), {
      type: "draw-volume",
      channel: "c0",
      volume: true,
    });
    expect(volumeTiles(on)).toEqual(["r0_c1"]);
    expect(volumeTiles(reduce(on, { type: "choose-tile", tile: "r0_c2" }))).toEqual(["r0_c2"]);
    expect(volumeTiles(reduce(on, { type: "choose-scope", scope: "all" }))).toHaveLength(3);
    expect(volumeTiles(reduce(on, { type: "show", channel: "c0", shown: false }))).toEqual([]);
  });

  it("hides a surface only where its volume has arrived", () => {
    const on = reduce(initialState(manifest(2)), {
      type: "draw-volume",
      channel: "c0",
      volume: true,
    });
    expect(isSurfaceShown(on, "c0", "r0_c1", false)).toBe(true);
    expect(isSurfaceShown(on, "c0", "r0_c1", true)).toBe(false);
    expect(isSurfaceShown(on, "c0", "r0_c0", true)).toBe(true);
    expect(isSurfaceShown(on, "c1", "r0_c1", true)).toBe(true);
  });

  it("refuses more volumes than one march can sample, in words", () => {
    const full = after(
      initialState(manifest(6)),
      ...Array.from(
        { length: MAX_VOLUME_CHANNELS + 1 },
        (_, i) => ({ type: "draw-volume", channel: `c${i}`, volume: true }) as const,
      ),
    );
    expect(full.channels.filter((c) => c.volume)).toHaveLength(MAX_VOLUME_CHANNELS);
    expect(full.notices).toEqual([
      "At most 4 channels can be volumes at once: turn one off first.",
    ]);
  });

  it("ignores tiles and transfer functions that the bundle does not have", () => {
    const state = initialState(manifest(1));
    expect(reduce(state, { type: "choose-tile", tile: "r9_c9" })).toBe(state);
    const chosen = reduce(state, {
      type: "choose-transfer-function",
      channel: "c0",
      name: "no such",
    });
    expect(chosen.channels[0].transferFunction).toBe("default");
  });

  it("says each fault once and forgets it when dismissed", () => {
    const text = "channels/c0/r0_c0/lod0.glb: not found (404)";
    const twice = after(
      initialState(manifest(1)),
      { type: "notify", text },
      { type: "notify", text },
    );
    expect(twice.notices).toEqual([text]);
    expect(reduce(twice, { type: "dismiss", text }).notices).toEqual([]);
  });
});
