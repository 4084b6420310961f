import { describe, expect, it } from "vitest";
import type { Manifest } from "./bundle/generated/bundle";
import {
  CHANNELS_AT_START,
  initialState,
  isSurfaceShown,
  MAX_VOLUME_CHANNELS,
  type Representation,
  reduce,
  type ViewerState,
  VOLUME_TILES_AT_START,
  volumeTiles,
  wantsSurface,
} from "./state";

const FILE = { path: "x", bytes: 0, sha256: "0".repeat(64) };
const BOUNDS: Manifest["specimen"]["bounds_um"] = { min: [0, 0, 0], max: [3, 1, 1] };
const tile = (id: string, x: number): Manifest["tiles"][number] => ({
  id,
  representation: "mesh",
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
      surface: i === 1 ? "none" : "clear",
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

function unclear(given: Manifest, ...indices: number[]): Manifest {
  const channels = given.channels.map((channel, i) =>
    indices.includes(i) ? { ...channel, surface: "unclear" as const } : channel,
  );
  return { ...given, channels };
}

/** What the stage draws in the tiles of the row, from the left. */
function staged(given: Manifest, representations: Readonly<Record<string, Representation>>) {
  const [first, ...others] = given.tiles.map((each) => ({
    ...each,
    representation: representations[each.id] ?? each.representation,
  }));
  return { ...given, tiles: [first, ...others] } satisfies Manifest;
}

/** The tiles in which any channel is a volume. */
function marched(state: ViewerState): readonly string[] {
  const drawn = state.channels.map((c) => volumeTiles(state, c));
  return state.tiles.map(({ id }) => id).filter((id) => drawn.some((tiles) => tiles.includes(id)));
}

/** How a channel is drawn in a tile once all has arrived. */
function looks(state: ViewerState, channel: string, tile: string): string {
  const hasVolume = state.channels.some(
    (c) => c.id === channel && volumeTiles(state, c).includes(tile),
  );
  const parts = isSurfaceShown(state, channel, tile, hasVolume) ? ["surface"] : [];
  return [...parts, ...(hasVolume ? ["volume"] : [])].join(" + ");
}

function after(state: ViewerState, ...actions: Parameters<typeof reduce>[1][]): ViewerState {
  return actions.reduce(reduce, state);
}

describe("the viewer's state", () => {
  it("opens with surfaces of the first channels, no volume, the middle tile chosen", () => {
    const state = initialState(manifest(70));
    expect(state.channels.filter((c) => c.shown)).toHaveLength(CHANNELS_AT_START);
    expect(state.channels[1].hasSurface).toBe(false);
    expect(marched(state)).toEqual([]);
    expect(state.tile).toBe("r0_c1");
  });

  it("opens channels without a clear surface as volumes in all tiles, and loads no surface", () => {
    const state = initialState(unclear(manifest(3), 0));
    expect(state.channels.map((c) => c.volume)).toEqual([true, false, false]);
    expect(marched(state)).toHaveLength(3);
    expect(wantsSurface(state, state.channels[0])).toBe(false);
    expect(isSurfaceShown(state, "c0", "r0_c0", false)).toBe(false);
    expect(wantsSurface(state, state.channels[2])).toBe(true);
    const asked = reduce(state, { type: "draw-volume", channel: "c0", volume: false });
    expect(isSurfaceShown(asked, "c0", "r0_c0", false)).toBe(true);
  });

  it("opens no more volumes than one march can sample, and leaves the rest off", () => {
    const state = initialState(unclear(manifest(8), 0, 2, 3, 4, 5, 7));
    expect(state.channels.filter((c) => c.volume)).toHaveLength(MAX_VOLUME_CHANNELS);
    expect(state.channels[5].shown).toBe(false);
    // shown later, it is a volume if there is room
    const full = reduce(state, { type: "show", channel: "c7", shown: true });
    expect(full.channels[7].volume).toBe(false);
    const freed = reduce(state, { type: "draw-volume", channel: "c0", volume: false });
    expect(reduce(freed, { type: "show", channel: "c7", shown: true }).channels[7].volume).toBe(
      true,
    );
  });

  it("opens a specimen of many tiles with the volumes of one", () => {
    const many = unclear(manifest(1), 0);
    const [first] = many.tiles;
    const others = Array.from({ length: VOLUME_TILES_AT_START }, (_, i) => tile(`r1_c${i}`, i));
    expect(marched(initialState({ ...many, tiles: [first, ...others] }))).toHaveLength(1);
  });

  it("shows a volume in the chosen tile, or in all", () => {
    const on = reduce(initialState(manifest(2)), {
      type: "draw-volume",
      channel: "c0",
      volume: true,
    });
    expect(marched(on)).toEqual(["r0_c1"]);
    expect(marched(reduce(on, { type: "choose-tile", tile: "r0_c2" }))).toEqual(["r0_c2"]);
    expect(marched(reduce(on, { type: "choose-scope", scope: "all" }))).toHaveLength(3);
    expect(marched(reduce(on, { type: "show", channel: "c0", shown: false }))).toEqual([]);
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

describe("what the stage draws in a tile", () => {
  const MIXED = { r0_c0: "volume", r0_c2: "both" } as const;

  it("is what the viewer opens with, whatever the other tiles are", () => {
    const state = initialState(staged(manifest(3), MIXED));
    expect(state.channels.every((c) => c.shown && c.volume)).toBe(true);
    for (const channel of ["c0", "c2"]) {
      expect(looks(state, channel, "r0_c0")).toBe("volume");
      expect(looks(state, channel, "r0_c1")).toBe("surface");
      expect(looks(state, channel, "r0_c2")).toBe("surface + volume");
      expect(wantsSurface(state, state.channels[0])).toBe(true);
    }
    expect(marched(state)).toEqual(["r0_c0", "r0_c2"]);
  });

  it("leaves channels without a clear surface as volumes, and gives their surface to `both`", () => {
    const state = initialState(staged(unclear(manifest(3), 0), MIXED));
    expect(looks(state, "c0", "r0_c0")).toBe("volume");
    expect(looks(state, "c0", "r0_c1")).toBe("volume");
    expect(looks(state, "c0", "r0_c2")).toBe("surface + volume");
    expect(looks(state, "c2", "r0_c1")).toBe("surface");
    expect(wantsSurface(state, state.channels[0])).toBe(true);
    const without = initialState(staged(unclear(manifest(3), 0), { r0_c0: "volume" }));
    expect(wantsSurface(without, without.channels[0])).toBe(false);
  });

  it("shows no surface in a volume tile: what one march has no room for is off", () => {
    const state = initialState(staged(unclear(manifest(6), 5), { r0_c0: "volume" }));
    const shown = state.channels.filter((c) => c.shown);
    expect(shown.map((c) => c.id)).toEqual(["c0", "c1", "c2", "c5"]);
    for (const { id } of state.channels) expect(looks(state, id, "r0_c0")).not.toMatch("surface");
    const both = initialState(staged(manifest(6), { r0_c0: "both" }));
    expect(both.channels.filter((c) => c.shown)).toHaveLength(6);
    expect(looks(both, "c5", "r0_c0")).toBe("surface");
  });

  it("holds for a channel that is shown later, if there is room", () => {
    const state = initialState(staged(manifest(5), { r0_c0: "volume" }));
    const freed = after(
      state,
      { type: "draw-volume", channel: "c0", volume: false },
      { type: "show", channel: "c4", shown: true },
    );
    expect(looks(freed, "c4", "r0_c0")).toBe("volume");
    expect(looks(freed, "c4", "r0_c1")).toBe("surface");
  });

  it("gives way to what the user chooses", () => {
    const state = initialState(staged(manifest(3), MIXED));
    const off = reduce(state, { type: "draw-volume", channel: "c0", volume: false });
    expect(looks(off, "c0", "r0_c0")).toBe("surface");
    expect(looks(off, "c2", "r0_c0")).toBe("volume");

    const all = reduce(state, { type: "choose-scope", scope: "all" });
    for (const { id } of state.tiles) expect(looks(all, "c0", id)).toBe("volume");
    const back = reduce(all, { type: "choose-scope", scope: "stage" });
    expect(back).toEqual(state);

    for (const { id } of state.tiles) {
      const chosen = reduce(state, { type: "choose-tile", tile: id });
      expect(chosen.scope).toBe("one");
      expect(marched(chosen)).toEqual([id]);
      expect(looks(chosen, "c0", id)).toBe("volume");
    }
    const middle = reduce(state, { type: "choose-tile", tile: "r0_c1" });
    expect(looks(middle, "c0", "r0_c0")).toBe("surface");
  });

  it("opens as volumes only so many tiles, from the middle, and says so", () => {
    const many = unclear(manifest(3), 2);
    const tiles = Array.from({ length: VOLUME_TILES_AT_START + 4 }, (_, i) => ({
      ...tile(`r1_c${i}`, i - 10),
      representation: "volume" as const,
    }));
    const [first] = many.tiles;
    const state = initialState({ ...many, tiles: [first, ...tiles] });
    expect(volumeTiles(state, state.channels[0])).toHaveLength(VOLUME_TILES_AT_START);
    expect(volumeTiles(state, state.channels[0])).not.toContain("r1_c0");
    expect(looks(state, "c0", "r1_c0")).toBe("surface");
    // without a clear surface: there and in the chosen tile
    expect(volumeTiles(state, state.channels[2])).toHaveLength(VOLUME_TILES_AT_START + 1);
    expect(state.notices).toEqual([
      'The stage draws 20 tiles as volumes: the 16 in the middle are, "All tiles" draws the rest.',
    ]);
  });
});
