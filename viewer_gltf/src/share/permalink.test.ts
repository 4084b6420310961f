import { describe, expect, it } from "vitest";
import { SPECIMEN_BOX, sampleManifest } from "../../test/support/fixture/manifest";
import { seeded } from "../../test/support/seeded";
import { fromHex } from "../math/color";
import type { Action } from "../state/actions";
import type { CameraView } from "../state/camera_view";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import { MAX_CHANNELS, type ViewerState } from "../state/viewer_state";
import { readLink, writeLink } from "./permalink";

const start = (channels = 6) => initialState(sampleManifest(channels));
const after = (state: ViewerState, actions: readonly Action[]) => actions.reduce(reduce, state);
const read = (hash: string, state = start()) => readLink(hash, state, SPECIMEN_BOX);
const opened = (hash: string) => after(start(), read(hash).actions);
const noticesOf = (hash: string) => opened(hash).notices;

const CHANGES: readonly Action[] = [
  { type: "show", channel: "c1", shown: false },
  { type: "show", channel: "c5", shown: true },
  { type: "set", id: "color", channel: "c5", value: fromHex("#12ab9f") },
  { type: "set", id: "color", channel: "c4", value: fromHex("#0000ff") }, // hidden, but still part of the state
  { type: "set", id: "opacity", channel: "c0", value: 0.35 },
  { type: "window", channel: "c0", window: [0.125, 0.75] },
  { type: "set", id: "volume", channel: "c2", value: false },
  { type: "choose-transfer-function", channel: "c3", name: "soft" },
  { type: "set", id: "mode", value: "tile" },
  { type: "set", id: "switch-distance", value: 2.34 },
  { type: "set", id: "disc-radius", value: 17.5 },
  { type: "select", tile: "r1_c3" },
  { type: "isolate", tile: "r0_c2" },
  {
    type: "set-clip",
    clip: {
      box: { min: [1, -12.5, 2], max: [30, -2, 7.25] },
      plane: { normal: [0.6, 0, 0.8], offset_um: 12 },
    },
  },
  {
    type: "measure",
    points: [
      [1.25, -3, 4],
      [40.5, -17, 0],
    ],
  },
  { type: "set", id: "tool", value: "measure" },
  { type: "set", id: "dwell", value: false },
  { type: "set", id: "quality", value: "low" },
  { type: "set", id: "trace/lamps", value: true },
];
const CAMERA: CameraView = {
  position: [0.5, -0.25, 1.75],
  target: [0.1, 0, -0.05],
  specimen: { position: [0, 0, -1.5], orientation: [0, 0.6, 0, 0.8], scale: 2.5 },
};
/** Returns a view without its notices and without the order in which channels were shown. */
const viewOf = (state: ViewerState) => ({
  ...state,
  notices: [],
  channels: state.channels.map((channel) => ({ ...channel, turn: 0 })),
});

describe("a link to a view", () => {
  it("restores the whole state and the camera", () => {
    const state = after(start(), CHANGES);
    const hash = writeLink(state, start(), CAMERA);
    expect(viewOf(opened(hash))).toEqual(viewOf(state));
    const camera = read(hash).camera;
    expect(camera?.position).toEqual(CAMERA.position);
    expect(camera?.target).toEqual(CAMERA.target);
    expect(camera?.specimen?.scale).toBe(2.5);
    camera?.specimen?.orientation.forEach((part, i) => {
      expect(part).toBeCloseTo(CAMERA.specimen?.orientation[i] ?? Number.NaN, 6);
    });
  });

  it("restores each single change", () => {
    for (const change of CHANGES) {
      const state = after(start(), [change]);
      const hash = writeLink(state, start(), null);
      expect(viewOf(opened(hash)), hash).toEqual(viewOf(state));
    }
  });

  it("leaves out everything that equals the opening state, and is short", () => {
    expect(writeLink(start(), start(), null)).toBe("#v=1");
    const eye = { ...CAMERA, specimen: null };
    expect(writeLink(start(), start(), eye)).toBe("#v=1&eye=0.5,-0.25,1.75,0.1,0,-0.05");
    expect(writeLink(after(start(), CHANGES), start(), CAMERA).length).toBeLessThan(400);
  });

  it("contains the objects' part as their own code writes it, or as an earlier link had it", () => {
    const linked = '{"picked":"7"}';
    const before = after(start(), [
      { type: "objects", channel: start().channels[0].id, change: { linked } },
    ]);
    const { id } = start().channels[0];
    const hash = writeLink(before, start(), null);
    expect(opened(hash).objects[id].linked).toBe(linked);
    expect(writeLink(before, start(), null, () => "")).toBe("#v=1");
    expect(opened(writeLink(before, start(), null, (of) => of)).objects[id].linked).toBe(id);
  });

  it("needs no escaping in a URL", () => {
    const hash = writeLink(after(start(), CHANGES), start(), CAMERA);
    const url = new URL("https://example.org/view/?bundle=x");
    url.hash = hash;
    expect(url.hash).toBe(hash);
    expect(hash).toMatch(/^#[\w=&,.:+-]*$/);
  });

  it("can hide every channel", () => {
    const hidden = start().channels.map(
      ({ id }): Action => ({ type: "show", channel: id, shown: false }),
    );
    const state = after(start(), hidden);
    const hash = writeLink(state, start(), null);
    expect(opened(hash).channels.some(({ shown }) => shown)).toBe(false);
  });

  it("reports channels and tiles that the bundle does not have, and shows the rest", () => {
    const state = opened("#v=1&c=c5,CD8&l=CD4:o0.5,c5:o0.5&tile=r9_c9&disc=20");
    expect(state.notices).toEqual([
      "Link: this bundle has no channel CD8, channel CD4, tile r9_c9.",
    ]);
    expect(state.channels.flatMap(({ id, shown }) => (shown ? [id] : []))).toEqual(["c5"]);
    expect(state.channels[5].opacity).toBe(0.5);
    expect(state.discRadius_deg).toBe(20);
    expect(state.selected).toBeNull();
  });

  it("contains the measurements with their names, and the slices", () => {
    const changes: readonly Action[] = [
      {
        type: "set-measurements",
        measurements: [
          {
            name: "wall: left; 1",
            kind: "angle",
            points: [
              [1, -3, 4],
              [5, -17, 0],
              [9, -1, 8],
            ],
          },
          {
            name: "",
            kind: "line",
            points: [
              [1, -3, 4],
              [5, -17, 0],
              [9, -1, 8],
              [9, -2, 8],
            ],
          },
        ],
      },
      { type: "move-slices", at: [0.25, 0.5, 0.75], turn_deg: [10, -20, 30] },
      { type: "set", id: "slice-planes", value: true },
      {
        type: "keep-views",
        views: [
          { position: [0, 0.5, 2], target: [0, 0, 0] },
          { position: [1.5, 0, 0.25], target: [0.1, 0, 0] },
        ],
      },
    ];
    const state = after(start(), changes);
    const hash = writeLink(state, start(), null);
    expect(new URL(hash, "https://host.test/").hash).toBe(hash);
    expect(viewOf(opened(hash))).toEqual(viewOf(state));
    // The newest measurement is included, too: a finished angle is added to the list.
    const angle = after(state, [
      { type: "set", id: "measure-kind", value: "angle" },
      {
        type: "measure",
        points: [
          [1, -1, 1],
          [2, -2, 2],
          [3, -1, 3],
        ],
      },
    ]);
    const again = opened(writeLink(angle, start(), null));
    expect(again.measurements.map(({ name }) => name)).toEqual(["wall: left; 1", "", "Angle 1"]);
  });

  it("shows the default channels if it comes from another bundle", () => {
    const shown = (state: ViewerState) => state.channels.map((channel) => channel.shown);
    expect(shown(opened("#v=1&c=CD8,CD4"))).toEqual(shown(start()));
  });

  it("is only reported if a newer viewer wrote it, or no viewer", () => {
    expect(noticesOf("#v=2&disc=20")).toEqual([
      "Link: v is 2, expected 1: open the link with the viewer that wrote it.",
    ]);
    expect(noticesOf("#section-3")).toHaveLength(1);
    expect(opened("#v=2&disc=20").discRadius_deg).toBe(start().discRadius_deg);
    expect(read("")).toEqual({ actions: [], camera: null });
    expect(read("#")).toEqual({ actions: [], camera: null });
  });

  it("shows no more channels than fit", () => {
    const state = opened("#v=1&c=c5,c4,c3,c2,c1,c0,c5,c5");
    expect(state.channels.filter(({ shown }) => shown)).toHaveLength(MAX_CHANNELS);
    expect(state.notices).toEqual([]);
  });

  it.each([
    ["#v=1&switch=NaN", "switch"],
    ["#v=1&switch=Infinity", "switch"],
    ["#v=1&disc=1e99", "disc"],
    ["#v=1&disc=", "disc"],
    ["#v=1&mode=constructor", "mode"],
    ["#v=1&box=0,0,0,0,0,0", "box"],
    ["#v=1&box=40,-10,4,10,-5,6", "box"],
    ["#v=1&cut=0,0,0,5", "cut"],
    ["#v=1&points=1,2", "points"],
    ["#v=1&views=0,0,2,0,0", "views"],
    ["#v=1&measures=d:one:1,2,3", "measures d:one:1,2,3"],
    ["#v=1&measures=a:%ff:1,2,3,1,2,3,1,2,9", "measures a:%ff:1,2,3,1,2,3,1,2,9"],
    ["#v=1&points=1,2,3,4,5,6,7", "points"],
    ["#v=1&eye=0,0,0,0,0,0", "eye"],
    ["#v=1&eye=0,0,1e6,0,0,0", "eye"],
    ["#v=1&eye=0,0,1,0,0,0&pose=0,0,0,0,0,0,0,1", "eye"],
    ["#v=1&quality=ultra", "quality"],
    ["#v=1&l=c0:oNaN", "l c0:oNaN"],
    ["#v=1&l=c0:c12345", "l c0:c12345"],
    ["#v=1&l=c0:tevil", "l c0:tevil"],
  ])("%s is reported and left out", (hash, named) => {
    expect(noticesOf(hash)).toEqual([`Link: left out parts that can't be read: ${named}.`]);
    const { notices, ...state } = opened(hash);
    const { notices: _, ...opening } = start();
    expect(state).toEqual(opening);
  });

  it("leaves out the cut that the bundle opens with, and states if the user removed it", () => {
    const plain = sampleManifest(2);
    const cut = { normal: [1, 0, 0] as [number, number, number], offset_um: 3 };
    const start = initialState({ ...plain, specimen: { ...plain.specimen, cut } });
    expect(writeLink(start, start, null)).toBe("#v=1");
    const closed = reduce(start, { type: "set-clip", clip: { box: null, plane: null } });
    const link = writeLink(closed, start, null);
    expect(link).toBe("#v=1&cut=none");
    const { actions } = readLink(link, start, SPECIMEN_BOX);
    expect(after(start, actions).clip.plane).toBeNull();
  });

  it("keeps cuts and points within the specimen", () => {
    const state = opened("#v=1&box=-900,-900,-900,900,900,900&cut=0,0,1,9999&points=7e5,0,-7e5");
    expect(state.clip.box).toEqual(SPECIMEN_BOX);
    expect(state.clip.plane?.offset_um).toBe(8);
    expect(state.measured).toEqual([[50, 0, 0]]);
  });

  it("is harmless if it is ten kilobytes of junk", () => {
    const random = seeded(7);
    const letters = "v=1&cl,:~%00ff_.-+eye<>\"'{}[]\\ \u0000\ud800ctwon0129";
    for (let round = 0; round < 200; round++) {
      const length = Math.floor(random() * 10_000);
      let junk = round % 2 === 0 ? "#v=1&" : "#";
      for (let i = 0; i < length; i++) junk += letters[Math.floor(random() * letters.length)];
      const { actions } = read(junk);
      const state = after(start(), actions);
      expect(state.notices.length).toBeLessThan(4);
      expect(state.notices.join().length).toBeLessThan(600);
      const numbers = JSON.stringify(
        state.channels.map(({ window, opacity }) => [window, opacity]),
      );
      expect(numbers).not.toContain("null"); // JSON writes NaN as null
    }
  });

  it("still opens if it is cut short anywhere", () => {
    const hash = writeLink(after(start(), CHANGES), start(), CAMERA);
    for (let length = 0; length < hash.length; length++) {
      const state = opened(hash.slice(0, length));
      expect(state.channels.some(({ opacity }) => !Number.isFinite(opacity))).toBe(false);
    }
  });
});
