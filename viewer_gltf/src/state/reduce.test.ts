import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Manifest } from "../bundle/generated/bundle";
import { initialState, VOLUME_TILES_AT_START } from "./initial_state";
import { DISC_RADIUS, SWITCH_DISTANCE } from "./parameters/volumes";
import { newNotice, reduce } from "./reduce";
import {
  type FocusTiles,
  hiddenShare,
  isInDisc,
  NO_FOCUS,
  representationOf,
  wantedTiles,
  wantsSurface,
} from "./representation";
import { MAX_CHANNELS, type Representation, type ViewerState } from "./viewer_state";

function unclear(given: Manifest, ...indices: number[]): Manifest {
  const channels = given.channels.map((channel, i) =>
    indices.includes(i)
      ? { ...channel, tileset: null, surface_reason: "no clear surface: all is noise" }
      : channel,
  );
  return { ...given, channels };
}

/** The manifest with other representations of some tiles. */
function staged(given: Manifest, representations: Readonly<Record<string, Representation>>) {
  const [first, ...others] = given.tiles.map((each) => ({
    ...each,
    representation: representations[each.id] ?? each.representation,
  }));
  return { ...given, tiles: [first, ...others] } satisfies Manifest;
}

/** The tile in the middle, and a row of `count` other tiles beside it. */
function withRow(given: Manifest, count: number, representation: Representation = "mesh") {
  const middle = given.tiles[2];
  const row = Array.from({ length: count }, (_, i): typeof middle => {
    const x = 25 + 10 * (i - count / 2);
    const bounds_um: typeof middle.bounds_um = { min: [x, -10, 0], max: [x + 10, 0, 8] };
    return { id: `r1_c${i}`, representation, bounds_um };
  });
  return { ...given, tiles: [middle, ...row] } satisfies Manifest;
}

/** Tiles within the volume distance; the gaze is on the first of them. */
const near = (...tiles: readonly string[]): FocusTiles => ({
  focusTile: tiles[0],
  disc: tiles,
  near: new Set(tiles),
});

/** The tiles in which any channel is drawn as a volume. */
function marched(state: ViewerState, focusTiles: FocusTiles = NO_FOCUS): readonly string[] {
  return wantedTiles(state, focusTiles).map(({ tile: id }) => id);
}

function find(state: ViewerState, channel: string, id: string) {
  const c = state.channels.find((each) => each.id === channel);
  const t = state.tiles.find((each) => each.id === id);
  if (c === undefined || t === undefined) throw new Error(`no ${channel} in ${id}`);
  return [c, t] as const;
}

/** How a channel is drawn in a tile once all is loaded. */
function drawnAs(state: ViewerState, channel: string, id: string, focusTiles = NO_FOCUS): string {
  const [c, t] = find(state, channel, id);
  const as = representationOf(state, c, t, focusTiles);
  return as === null ? "" : { mesh: "surface", volume: "volume", both: "surface + volume" }[as];
}

function after(state: ViewerState, ...actions: Parameters<typeof reduce>[1][]): ViewerState {
  return actions.reduce(reduce, state);
}

describe("the viewer's state", () => {
  it("opens with surfaces of the first channels, and volumes for near tiles", () => {
    const state = initialState(sampleManifest(70));
    expect(state.channels.filter((c) => c.shown)).toHaveLength(MAX_CHANNELS);
    expect(state.channels[1].hasSurface).toBe(false);
    expect(state.mode).toBe("disc");
    expect(marched(state)).toEqual([]);
    expect(marched(state, near("r0_c2", "r0_c1"))).toEqual(["r0_c2", "r0_c1"]);
    expect(state.middle).toBe("r0_c2");
  });

  it("opens with a label map as surfaces", () => {
    const plain = sampleManifest(6);
    const table = { path: "o.json", bytes: 1, sha256: "0".repeat(64) };
    const channels = plain.channels.map((one, i) =>
      i === 5 ? { ...one, objects: table } : { ...one, opens: false },
    );
    const state = initialState({ ...plain, channels });
    expect(state.channels.filter((c) => c.shown).map((c) => c.id)).toEqual(["c5"]);
    // label maps have no volumes: they stay surfaces at every distance
    expect(state.channels.map((c) => c.volume)).toEqual([true, true, true, true, true, false]);
    expect(drawnAs(state, "c5", "r0_c2", near("r0_c2"))).toBe("surface");
  });

  it("opens with the clip plane and the channels of the stage", () => {
    const plain = sampleManifest(4);
    expect(initialState(plain).clip.plane).toBeNull();
    const cut = { normal: [1, 0, 0] as [number, number, number], offset_um: 7 };
    const channels = plain.channels.map((one, i) => ({ ...one, opens: i > 1 }));
    const state = initialState({ ...plain, channels, specimen: { ...plain.specimen, cut } });
    expect(state.clip.plane).toEqual(cut);
    expect(state.channels.filter((c) => c.shown).map((c) => c.id)).toEqual(["c2", "c3"]);
    const hidden = plain.channels.map((one) => ({ ...one, opens: false }));
    const none = initialState({ ...plain, channels: hidden });
    expect(none.channels.some((c) => c.shown)).toBe(false);
  });

  it("draws an unsure surface from afar like a clear one", () => {
    const clear = sampleManifest(1);
    const [first] = clear.channels;
    const reason = "unsure surface: at 162 with a confidence of 0.40";
    const channels = [{ ...first, surface: "unsure" as const, surface_reason: reason }];
    const [unsure, trusted] = [{ ...clear, channels }, clear].map((one) => initialState(one));
    expect(unsure.channels[0].surfaceReason).toBe(reason);
    const drawn = (state: ViewerState) =>
      state.tiles.map((tile) => representationOf(state, state.channels[0], tile, NO_FOCUS));
    expect(drawn(unsure)).toEqual(drawn(trusted));
  });

  it("hides the channel that was shown longest for a fifth one, without a notice", () => {
    const state = initialState(sampleManifest(7));
    const five = reduce(state, { type: "show", channel: "c5", shown: true });
    const shown = (each: ViewerState) => each.channels.filter((c) => c.shown).map((c) => c.id);
    expect(shown(five)).toEqual(["c1", "c2", "c3", "c5"]);
    expect(five.notices).toEqual([]);
    const back = reduce(five, { type: "show", channel: "c0", shown: true });
    expect(shown(back)).toEqual(["c0", "c2", "c3", "c5"]);
    const room = after(
      back,
      { type: "show", channel: "c2", shown: false },
      { type: "show", channel: "c6", shown: true },
    );
    expect(shown(room)).toEqual(["c0", "c3", "c5", "c6"]);
    expect(reduce(state, { type: "show", channel: "c0", shown: true })).toBe(state);
  });

  it("opens channels without a clear surface as volumes in all tiles, and loads no surface", () => {
    const state = initialState(unclear(sampleManifest(3), 0));
    expect(marched(state)).toHaveLength(state.tiles.length);
    expect(wantedTiles(state, NO_FOCUS)[0].channels).toEqual(["c0"]);
    expect(wantsSurface(state, state.channels[0])).toBe(false);
    expect(drawnAs(state, "c0", "r0_c0")).toBe("volume");
    expect(isInDisc(state, state.channels[0])).toBe(false);
    expect(isInDisc(state, state.channels[2])).toBe(true);
    expect(wantsSurface(state, state.channels[2])).toBe(true);
    const asked = reduce(state, { type: "set", id: "volume", channel: "c0", value: false });
    expect(drawnAs(asked, "c0", "r0_c0")).toBe("surface");
    const off = reduce(state, { type: "set", id: "mode", value: "off" });
    expect(drawnAs(off, "c0", "r0_c0")).toBe("surface");
    expect(wantsSurface(off, off.channels[0])).toBe(true);
  });

  it("opens a specimen of many tiles with the volumes of one", () => {
    const many = unclear(sampleManifest(1), 0);
    const state = initialState(withRow(many, VOLUME_TILES_AT_START));
    expect(marched(state)).toEqual([state.middle]);
    expect(marched(state, { ...near("r1_c0"), disc: [] })).toEqual(["r1_c0"]);
    expect(marched(reduce(state, { type: "select", tile: "r1_c3" }))).toEqual(["r1_c3"]);
  });

  it("shows a volume in the gazed tile, the selected one, or in all", () => {
    const gaze = near("r0_c1", "r0_c0", "r0_c2");
    const state = reduce(initialState(sampleManifest(2)), {
      type: "set",
      id: "mode",
      value: "tile",
    });
    expect(marched(state)).toEqual([]);
    expect(marched(state, gaze)).toEqual(["r0_c1"]);
    const selected = reduce(state, { type: "select", tile: "r0_c2" });
    expect(marched(selected, gaze)).toEqual(["r0_c2"]);
    expect(marched(selected, near("r0_c1"))).toEqual([]); // the tile is too far away
    expect(marched(reduce(state, { type: "set", id: "mode", value: "all" }))).toHaveLength(
      state.tiles.length,
    );
    expect(marched(reduce(state, { type: "set", id: "mode", value: "off" }), gaze)).toEqual([]);
    const none = after(
      state,
      { type: "show", channel: "c0", shown: false },
      { type: "show", channel: "c1", shown: false },
    );
    expect(marched(none, gaze)).toEqual([]);
  });

  it("shows nothing but the isolated tile", () => {
    const state = reduce(initialState(sampleManifest(2)), { type: "isolate", tile: "r0_c0" });
    expect(drawnAs(state, "c0", "r0_c0")).toBe("surface");
    expect(drawnAs(state, "c0", "r0_c1")).toBe("");
    const all = reduce(state, { type: "set", id: "mode", value: "all" });
    expect(marched(all)).toEqual(["r0_c0"]);
  });

  it("hides a surface as far as its volume has faded in", () => {
    const focusTiles = near("r0_c1");
    const state = initialState(unclear(sampleManifest(3), 2));
    const taken = (channel: string, id: string, presence: number) =>
      hiddenShare(state, ...find(state, channel, id), focusTiles, presence);
    expect(taken("c0", "r0_c1", 0)).toBe(0);
    expect(taken("c0", "r0_c1", 0.4)).toBe(0.4);
    expect(taken("c0", "r0_c0", 0)).toBe(0);
    expect(taken("c0", "r0_c0", 0.7)).toBe(0.7); // the volume fades out in a tile that no longer needs it
    expect(taken("c2", "r0_c1", 0)).toBeNull();
  });

  it("keeps values within their limits", () => {
    const state = initialState(sampleManifest(1));
    const far = reduce(state, { type: "set", id: "switch-distance", value: 1e9 });
    expect(far.switchDistance_m).toBe(SWITCH_DISTANCE.limits[1]);
    const wide = reduce(state, { type: "set", id: "disc-radius", value: -3 });
    expect(wide.discRadius_deg).toBe(DISC_RADIUS.limits[0]);
    const set = after(
      state,
      { type: "set", id: "opacity", channel: "c0", value: 3 },
      { type: "window", channel: "c0", window: [0.9, 0.2] },
    );
    const [{ opacity, window }] = set.channels;
    expect(opacity).toBe(1);
    expect(window[0]).toBe(0.9);
    expect(window[1]).toBeGreaterThan(0.9);
  });

  it("ignores tiles and transfer functions that the bundle does not have", () => {
    const state = initialState(sampleManifest(1));
    expect(reduce(state, { type: "select", tile: "r9_c9" })).toBe(state);
    const chosen = reduce(state, {
      type: "choose-transfer-function",
      channel: "c0",
      name: "no such",
    });
    expect(chosen.channels[0].transferFunction).toBe("default");
  });

  it("lists each fault once until it is dismissed", () => {
    const text = "channels/c0/r0_c0/lod0.glb: not found (404)";
    const twice = after(
      initialState(sampleManifest(1)),
      { type: "notify", text },
      { type: "notify", text },
    );
    expect(twice.notices).toEqual([text]);
    expect(reduce(twice, { type: "dismiss", texts: [text] }).notices).toEqual([]);
    expect(reduce(twice, { type: "dismiss", texts: ["another"] })).toBe(twice);
  });

  it("marks notices that another attempt may solve, until they are dismissed", () => {
    const opened = initialState(sampleManifest(6));
    const faulty = after(
      opened,
      { type: "notify", text: "a file is damaged" },
      { type: "notify", text: "no network", isRetryable: true },
    );
    expect(faulty.retryable).toEqual(["no network"]);
    expect(reduce(faulty, { type: "dismiss", texts: ["a file is damaged"] }).retryable).toEqual([
      "no network",
    ]);
    expect(reduce(faulty, { type: "dismiss", texts: ["no network"] }).retryable).toEqual([]);
  });

  it("returns the notice that a change has added, also a second time", () => {
    const brought = (before: ViewerState, action: Parameters<typeof reduce>[1]) =>
      newNotice(before, reduce(before, action));
    const faulty = after(
      initialState(sampleManifest(6)),
      { type: "notify", text: "a" },
      { type: "notify", text: "b" },
    );
    expect(brought(faulty, { type: "notify", text: "c" })).toBe("c");
    expect(brought(faulty, { type: "notify", text: "a" })).toBe("a");
    expect(brought(faulty, { type: "notify", text: "b" })).toBe("b");
    expect(brought(faulty, { type: "show", channel: "c4", shown: true })).toBeNull();
    expect(brought(faulty, { type: "dismiss", texts: ["a"] })).toBeNull();
    expect(brought(faulty, { type: "set", id: "opacity", channel: "c0", value: 0.5 })).toBeNull();
  });
});

describe("the stage's choice for a tile", () => {
  const MIXED = { r0_c0: "volume", r0_c2: "both" } as const;

  it("is used at the opening, independently of the other tiles", () => {
    const state = initialState(staged(sampleManifest(3), MIXED));
    expect(state.channels.every((c) => c.shown && c.volume)).toBe(true);
    for (const channel of ["c0", "c2"]) {
      expect(drawnAs(state, channel, "r0_c0")).toBe("volume");
      expect(drawnAs(state, channel, "r0_c1")).toBe("surface");
      expect(drawnAs(state, channel, "r0_c2")).toBe("surface + volume");
      expect(wantsSurface(state, state.channels[0])).toBe(true);
    }
    expect(marched(state)).toEqual(["r0_c0", "r0_c2"]);
  });

  it("draws channels without a clear surface as volumes, and with their surfaces for `both`", () => {
    const state = initialState(staged(unclear(sampleManifest(3), 0), MIXED));
    expect(drawnAs(state, "c0", "r0_c0")).toBe("volume");
    expect(drawnAs(state, "c0", "r0_c1")).toBe("volume");
    expect(drawnAs(state, "c0", "r0_c2")).toBe("surface + volume");
    expect(drawnAs(state, "c2", "r0_c1")).toBe("surface");
    expect(wantsSurface(state, state.channels[0])).toBe(true);
    const without = initialState(staged(unclear(sampleManifest(3), 0), { r0_c0: "volume" }));
    expect(wantsSurface(without, without.channels[0])).toBe(false);
  });

  it("gives way to what the user chooses", () => {
    const state = initialState(staged(sampleManifest(3), MIXED));
    const off = reduce(state, { type: "set", id: "volume", channel: "c0", value: false });
    expect(drawnAs(off, "c0", "r0_c0")).toBe("surface");
    expect(drawnAs(off, "c2", "r0_c0")).toBe("volume");

    const all = reduce(state, { type: "set", id: "mode", value: "all" });
    for (const { id } of state.tiles) expect(drawnAs(all, "c0", id)).toBe("volume");
    const back = reduce(all, { type: "set", id: "mode", value: "stage" });
    expect(back).toEqual(state);
  });

  it("opens only the tiles nearest the centre as volumes, with a notice", () => {
    const many = unclear(sampleManifest(3), 2);
    const state = initialState(withRow(many, VOLUME_TILES_AT_START + 4, "volume"));
    const tilesOf = (channel: string) =>
      wantedTiles(state, NO_FOCUS).filter(({ channels }) => channels.includes(channel));
    expect(tilesOf("c0")).toHaveLength(VOLUME_TILES_AT_START);
    expect(tilesOf("c0").map((each) => each.tile)).not.toContain("r1_c0");
    expect(drawnAs(state, "c0", "r1_c0")).toBe("surface");
    // without a clear surface, the volumes are drawn there and in the middle tile
    expect(new Set(tilesOf("c2").map((each) => each.tile))).toEqual(
      new Set([...tilesOf("c0").map((each) => each.tile), state.middle]),
    );
    expect(state.notices).toEqual([
      "The stage draws 20 tiles as volumes, but only the 16 nearest to the centre open as volumes. Choose “Volumes everywhere” to draw the rest.",
    ]);
  });
});

describe("the lamps", () => {
  it("are shown when they are switched on, in every mode", () => {
    const start = initialState(sampleManifest(3));
    expect(start.areLampsShown).toBe(false);
    const shown = reduce(start, { type: "set", id: "trace/lamps", value: true });
    expect(shown).toEqual({ ...start, areLampsShown: true });
    expect(reduce(shown, { type: "set", id: "trace/lamps", value: true })).toBe(shown);
    expect(reduce(shown, { type: "set", id: "mode", value: "off" }).areLampsShown).toBe(true);
    expect(reduce(shown, { type: "set", id: "trace/lamps", value: false })).toEqual(start);
  });
});
