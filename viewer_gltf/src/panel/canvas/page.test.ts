import { describe, expect, it } from "vitest";
import { STEREO_FACTS } from "../../../test/support/fixture/facts";
import { sampleManifest } from "../../../test/support/fixture/manifest";
import { buildPanel } from "../../../test/support/panel/whole_panel";
import { initialState } from "../../state/initial_state";
import { reduce } from "../../state/reduce";
import { REFUSED } from "../../state/refusals";
import type { ViewerState } from "../../state/viewer_state";
import { type Layout, type PanelView, START_VIEW } from "../controls";
import { blocksOf } from "./controls";
import { type Region, ROW } from "./draw_list";
import { type CanvasView, MAX_TARGETS, type Page, pageOf, paginate, START_CANVAS } from "./page";

/** Controls that use the camera of the flat screen, and save files. */
const SCREEN_CONTROLS = [
  "picture-size",
  "save-picture",
  "save-video",
  "keep-view",
  "next-view",
  "forget-views",
];
const start = (channels = 12) => initialState(sampleManifest(channels));
const SPLIT = { isAvailable: true, reason: "" };
const laidOut = (state: ViewerState, view: Partial<PanelView> = {}) =>
  buildPanel(state, { ...STEREO_FACTS, split: SPLIT }, { ...START_VIEW, ...view });

/** Every page of every section, and of every group. */
function allPages(state: ViewerState, view: Partial<PanelView> = {}): readonly Page[] {
  const layout = laidOut(state, view);
  return layout.sections.flatMap(({ id: tab, items }) => {
    const groups = items.flatMap(({ kind, id }) => (kind === "group" ? [id] : []));
    return [null, ...groups].flatMap((group) => pagesOf(layout, { ...START_CANVAS, tab, group }));
  });
}

function pagesOf(layout: Layout, view: CanvasView): readonly Page[] {
  const { count } = pageOf(layout, view);
  return Array.from({ length: count }, (_, page) => pageOf(layout, { ...view, page }));
}

/** All regions of the pages of a section or a group. */
function regionsOf(layout: Layout, tab: string, group: string | null = null): Page {
  const pages = pagesOf(layout, { ...START_CANVAS, tab, group });
  return { ...pages[0], regions: pages.flatMap(({ regions }) => regions) };
}

function find(page: Page, id: string): Region {
  const found = page.regions.find((region) => region.id === id);
  if (found === undefined) throw new Error(`no ${id} in ${page.regions.map((r) => r.id)}`);
  return found;
}

describe("the panel on a canvas", () => {
  const pages = allPages(start(), { picked: "c2", isHistogramOpen: true });

  it("has every control once", () => {
    for (const { regions } of pages) {
      const ids = regions.map(({ id }) => id);
      expect(new Set(ids).size).toBe(ids.length);
    }
  });

  it("leaves out no control that can be used in a headset", () => {
    const ids = new Set(pages.flatMap(({ regions }) => regions.map(({ id }) => id.split("=")[0])));
    for (const { items } of laidOut(start(), { picked: "c2", isHistogramOpen: true }).sections) {
      for (const item of items) {
        const inRow = item.kind === "group" ? item.controls : [item];
        const isOpen = item.kind === "group" && item.isOpen;
        const controls = isOpen ? [...inRow, ...item.more] : inRow;
        for (const { id, kind, refusal } of controls) {
          const isElsewhere =
            [
              "stereo",
              "split",
              "measure-screen",
              "help",
              "slice-pictures",
              ...SCREEN_CONTROLS,
            ].includes(id) || kind === "link";
          const isClosed = item.kind === "group" && !isOpen && kind === "choice";
          const isColour = kind === "colour"; // the free colours take its place
          if (isElsewhere || isClosed || isColour || refusal || kind === "text") continue;
          expect(ids, id).toContain(id);
        }
      }
    }
  });

  it("has every control of the flat panel except those that need the phone in the hand", () => {
    const view = { ...START_VIEW, picked: "c2", isHistogramOpen: true, lenses: "own" } as const;
    const traced = reduce(start(), { type: "set", id: "mode", value: "traced" });
    const offered = new Set<string>();
    const inStereo = new Set<string>();
    for (const state of [start(), traced]) {
      const onPage = { ...STEREO_FACTS, isStereo: false, split: SPLIT, canScan: true };
      const flat = buildPanel(state, onPage, view);
      for (const item of flat.sections.flatMap(({ items }) => items)) {
        const all = item.kind === "group" ? [...item.controls, ...item.more] : [item];
        for (const { id, kind, refusal } of item.kind !== "group" || item.isOpen ? all : []) {
          if (kind !== "text" && !refusal) offered.add(id);
        }
      }
      for (const { regions } of allPages(state, view)) {
        for (const { id } of regions) inStereo.add(id.split("=")[0]);
      }
    }
    // the free colours and those of the palettes take the place of any colour
    const isColour = (id: string) => /\/(color|palette)$|^lamp-\d-color$/.test(id);
    const missing = [...offered].filter((id) => !inStereo.has(id) && !isColour(id)).sort();
    // The missing controls need the phone out of its viewer, save files, list keys, or show slices beside the
    // specimen.
    const phone = ["lens-code", "scan", "measure-screen"];
    const files = SCREEN_CONTROLS.filter((id) => !["next-view", "forget-views"].includes(id));
    expect(missing).toEqual(
      [
        "stereo",
        "split",
        "screen-stereo",
        ...phone,
        ...files,
        "own-light",
        "help",
        "letters",
        "slice-pictures",
      ].sort(),
    );
  });

  it("has all ten moves, each repeated while it is held", () => {
    const { regions } = regionsOf(laidOut(start()), "move");
    const moves = regions.filter(({ repeats }) => repeats !== undefined);
    expect(new Set(moves.map((move) => move.repeats))).toEqual(
      new Set([
        ...["zoom-in", "zoom-out", "turn-left", "turn-right", "turn-up", "turn-down"],
        ...["pan-left", "pan-right", "pan-up", "pan-down"],
      ]),
    );
    for (const move of moves) expect(move.to(0.5)).toBe(move.repeats);
  });

  it("reports why a control is refused", () => {
    const off = reduce(start(), { type: "set", id: "mode", value: "off" });
    const page = regionsOf(laidOut(off), "volumes");
    const radius = find(regionsOf(laidOut(off), "volume-settings"), "disc-radius");
    expect(radius.isSlide).toBe(false);
    expect(radius.to(0.3)).toEqual({ canvas: "announce", text: REFUSED.disc });
    expect(find(page, "mode=disc").to(0)).toEqual({ type: "set", id: "mode", value: "disc" });
  });
});

describe("controls on a canvas", () => {
  it("make the same requests as those of the layout", () => {
    const channels = pageOf(laidOut(start()), { ...START_CANVAS, tab: "channels" });
    expect(find(channels, "c0/shown").to(0)).toEqual({ type: "show", channel: "c0", shown: false });
    expect(find(channels, "c3/open").to(0)).toEqual({ canvas: "fan", group: "c3" });
    const tiles = pageOf(laidOut(start()), { ...START_CANVAS, tab: "tiles" });
    expect(find(tiles, "tile-map=r1_c4").to(0)).toEqual({ type: "select", tile: "r1_c4" });
    const view = pageOf(laidOut(start()), { ...START_CANVAS, tab: "view" });
    expect(find(view, "reset").to(0)).toBe("reset");
  });

  it("slide from end to end in the control's steps, and reach the ends slightly inside the region", () => {
    const page = regionsOf(laidOut(start(), { picked: "c0" }), "channels", "c0");
    const opacity = find(page, "c0/opacity");
    const at = (across: number) => {
      const request = opacity.to(across);
      return typeof request === "object" && request !== null && "value" in request
        ? Number(request.value)
        : null;
    };
    expect([at(0), at(0.5), at(1)]).toEqual([0, 0.5, 1]);
    expect(at(0.04)).toBe(0);
    expect(100 * (at(0.337) ?? 0)).toBeCloseTo(Math.round(100 * (at(0.337) ?? 0)), 9);
  });

  it("move the ends of a window together but not past each other", () => {
    const shown = reduce(start(), { type: "window", channel: "c0", window: [0.25, 0.5] });
    const all = allPages(shown, { picked: "c0" }).flatMap(({ regions }) => regions);
    const [low] = all.filter(({ id }) => id === "c0/window=low");
    const [high] = all.filter(({ id }) => id === "c0/window=high");
    expect(low.to(1)).toEqual({ type: "window", channel: "c0", window: [0.5, 0.5] });
    expect(high.to(0)).toEqual({ type: "window", channel: "c0", window: [0.25, 0.25] });
  });
});

describe("pages on a canvas", () => {
  const block = { height: ROW, marks: [], regions: [] };

  it("hold all blocks in order, as many as fit", () => {
    const blocks = Array.from({ length: 20 }, (_, i) => ({ ...block, height: ROW + i }));
    const pages = paginate(blocks, 9 * ROW);
    expect(pages.flat()).toEqual(blocks);
    for (const page of pages) {
      expect(page.reduce((sum, { height }) => sum + height, 0)).toBeLessThanOrEqual(9 * ROW);
    }
  });

  it("hold at most six targets, except for a block with more", () => {
    const blocks = [2, 2, 2, 2, 8, 1].map((targets) => ({ ...block, targets }));
    const counts = paginate(blocks, 99 * ROW).map((page) => page.map(({ targets }) => targets));
    expect(counts).toEqual([[2, 2, 2], [2], [8], [1]]);
    expect(MAX_TARGETS).toBe(6);
  });

  it("do not grow with the bundle: each of 70 channels is found by name", () => {
    const channels = regionsOf(laidOut(start(70)), "channels");
    expect(find(channels, "next-channels").isStep).toBe(true);
    expect(channels.count).toBeLessThan(4);
  });

  it("step from tile to tile if a map would be too fine for the gaze", () => {
    const tiles = Array.from({ length: 400 }, (_, i) => ({
      id: `r${Math.floor(i / 20)}_c${i % 20}`,
      name: `${i}`,
      title: `Tile ${i}`,
      row: Math.floor(i / 20),
      column: i % 20,
      isFocus: i === 45,
      isSelected: false,
      isIsolated: false,
    }));
    const to = (tile: string) => ({ type: "select", tile }) as const;
    const map = { kind: "map", id: "map", label: "", rows: 20, columns: 20, tiles, to } as const;
    const [{ regions }] = blocksOf(map, 760);
    expect(regions.map((region) => [region.id, region.to(0)])).toEqual([
      ["map=before", { type: "select", tile: "r2_c4" }],
      ["map=after", { type: "select", tile: "r2_c6" }],
    ]);
  });

  it("draw a colour as a swatch", () => {
    const hex = "#12ab34";
    const palettes = [{ name: "p", colors: [{ name: "n", hex }] }];
    const [made] = blocksOf(
      { kind: "colour", id: "x", label: "X", value: hex, palettes, to: () => "reset" },
      500,
    );
    expect(made.marks.some((mark) => mark.kind === "box" && mark.fill === hex)).toBe(true);
  });
});
