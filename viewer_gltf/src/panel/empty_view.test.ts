import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { cornersOf } from "../math/box";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import { type Content, type EmptyView, emptyViewOf } from "./empty_view";

const MANIFEST = sampleManifest(3);
const start = initialState(MANIFEST);
const [{ id: TILE, bounds_um }] = MANIFEST.tiles;
const CONTENT: Content = {
  tiles: MANIFEST.tiles,
  opening: start,
  outline: () => cornersOf(MANIFEST.specimen.bounds_um),
  hasSurface: () => true,
  hasVolume: () => true,
  shownObjectCount: () => null,
};

const each = (state: ViewerState, change: Partial<ViewerState["channels"][number]>) => ({
  ...state,
  channels: state.channels.map((channel) => ({ ...channel, ...change })),
});

/** The state after a press on the button of an empty view. */
function after(state: ViewerState, empty: EmptyView | null): ViewerState {
  if (empty === null) throw new Error("the view is not empty");
  expect(empty.text).toMatch(/^[A-Z].*\.$/);
  return empty.offer.to.reduce<ViewerState>((now, each) => {
    if (typeof each === "string") throw new Error("no action");
    return reduce(now, each);
  }, state);
}

/** The sentence of an empty view; its button must lead to a view that shows something. */
function explained(state: ViewerState, content: Content = CONTENT): string {
  const empty = emptyViewOf(state, content);
  expect(emptyViewOf(after(state, empty), content)).toBeNull();
  return empty?.text ?? "";
}

describe("an empty view", () => {
  it("is not reported if something is shown", () => {
    expect(emptyViewOf(start, CONTENT)).toBeNull();
    const alone = reduce(start, { type: "isolate", tile: TILE });
    expect(emptyViewOf(alone, CONTENT)).toBeNull();
  });

  it("reports that all channels are hidden, and shows those of the opening again", () => {
    const hidden = each(start, { shown: false });
    expect(explained(hidden)).toBe("All channels are hidden.");
    const shown = ({ channels }: ViewerState) => channels.map((channel) => channel.shown);
    expect(shown(after(hidden, emptyViewOf(hidden, CONTENT)))).toEqual(shown(start));
  });

  it("reports that all shown channels are transparent", () => {
    expect(explained(each(start, { opacity: 0 }))).toContain("opacity of 0 %");
  });

  it("reports that a cut by a box or a plane removes everything", () => {
    const { min } = MANIFEST.specimen.bounds_um;
    const beside = { min: [min[0] - 9, min[1], min[2]], max: [min[0] - 8, 0, 9] } as const;
    const byBox = reduce(start, { type: "set-clip", clip: { box: beside, plane: null } });
    expect(explained(byBox)).toBe("The cut removes all of the specimen.");
    const plane = { normal: [0, 0, 1], offset_um: min[2] - 1 } as const;
    const byPlane = reduce(start, { type: "set-clip", clip: { box: null, plane } });
    expect(explained(byPlane)).toBe("The cut removes all of the specimen.");
    // at the very end of the specimen, the cut face is still visible
    const atEnd = { box: null, plane: { ...plane, offset_um: min[2] } };
    expect(emptyViewOf(reduce(start, { type: "set-clip", clip: atEnd }), CONTENT)).toBeNull();
  });

  it("detects a cut that leaves only the empty margin of the specimen", () => {
    const { min, max } = MANIFEST.specimen.bounds_um;
    const middle = (min[2] + max[2]) / 2;
    const inside = { min: [min[0], min[1], middle], max } as const;
    const content = { ...CONTENT, outline: () => cornersOf(inside) };
    const plane = { normal: [0, 0, 1], offset_um: middle - 1 } as const;
    const cut = reduce(start, { type: "set-clip", clip: { box: null, plane } });
    expect(emptyViewOf(cut, CONTENT)).toBeNull();
    expect(explained(cut, content)).toContain("The cut removes all");
  });

  it("reports that the isolated tile is cut away", () => {
    const alone = reduce(start, { type: "isolate", tile: TILE });
    const plane = { normal: [0, 0, 1], offset_um: bounds_um.min[2] - 1 } as const;
    const cut = reduce(alone, { type: "set-clip", clip: { box: null, plane } });
    expect(explained(cut)).toBe("The cut removes all of row 1, column 1.");
  });

  it("reports that the isolated tile, or the tile for volumes, is empty", () => {
    const bare = {
      ...CONTENT,
      hasSurface: (_: string, tile: string) => tile !== TILE,
      hasVolume: (_: string, tile: string) => tile !== TILE,
    };
    const alone = reduce(start, { type: "isolate", tile: TILE });
    expect(explained(alone, bare)).toContain("in row 1, column 1.");
    const chosen = reduce({ ...start, mode: "tile" }, { type: "select", tile: TILE });
    expect(explained(chosen, bare)).toContain("in row 1, column 1.");
    // No message appears as long as it is unknown whether the tile has a volume.
    expect(emptyViewOf(alone, { ...bare, hasVolume: () => null })).toBeNull();
  });

  it("reports that the isolated tile has only volumes, which are shown when near", () => {
    const content = { ...CONTENT, hasSurface: () => false };
    const alone = reduce(start, { type: "isolate", tile: TILE });
    for (const mode of ["disc", "tile"] as const) {
      const text = explained({ ...alone, mode }, content);
      expect(text).toContain("Move closer to see its volumes.");
    }
    for (const mode of ["stage", "off"] as const) {
      const text = explained({ ...alone, mode }, content);
      expect(text).toContain("Its volumes are not drawn in this mode.");
    }
  });

  it("reports that the volumes of channels without surfaces are off", () => {
    const off = { ...each(start, { hasSurface: false }), mode: "off" } as const;
    expect(explained(off)).toContain("have no surface");
    expect(explained(each(start, { hasSurface: false, volume: false }))).toContain("switched off");
  });

  it("reports that all objects are hidden, and shows them again", () => {
    const state = reduce(each(start, { hasObjects: true }), {
      ...{ type: "objects", channel: "c0", change: { only: [], hidden: [1] } },
    });
    const content = { ...CONTENT, shownObjectCount: () => 0 };
    const next = after(state, emptyViewOf(state, content));
    expect([next.objects.c0.only, next.objects.c0.hidden]).toEqual([null, []]);
  });
});
