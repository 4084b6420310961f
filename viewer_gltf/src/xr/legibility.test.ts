/**
 * Checks that the panel can be read in a Cardboard: pixels per letter, angles of targets.
 * STEREOCELL_LEGIBILITY_TABLE names a file for the figures.
 */
import { afterAll, describe, expect, it } from "vitest";
import { STEREO_FACTS } from "../../test/support/fixture/facts";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { buildPanel } from "../../test/support/panel/whole_panel";
import { writeTable } from "../../test/support/table";
import { BAR_HEIGHT, BAR_WIDTH, barOf } from "../panel/canvas/bar";
import type { Mark, Rect } from "../panel/canvas/draw_list";
import {
  HEIGHT,
  MAX_TARGETS,
  type Page,
  PX_PER_M,
  pageOf,
  START_CANVAS,
  WIDTH,
} from "../panel/canvas/page";
import { START_VIEW } from "../panel/controls";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import { type Screen, toScreen } from "./cardboard/lens";
import { BUILT_IN, type Profile } from "./cardboard/viewer_profile";
import { NOTICE_DISTANCE_M } from "./panel/notice";
import { NOTICE_PX_PER_M, noticeMarks } from "./panel/notice_queue";
import { PANEL_DISTANCE_M } from "./panel/placement";

/**
 * Height of the letter x as a share of the font size: the least of the fonts on phones (Roboto
 * 0.53, San Francisco 0.53, Segoe UI 0.50).
 */
const X_HEIGHT = 0.5;
const INCH_M = 0.0254;
const EDGE_M = 0.003;

type Phone = Readonly<{ width_px: number; height_px: number; perInch: number }>;
const PHONES: Readonly<Record<string, Phone>> = {
  "6.5 inches, 1600 x 720": { width_px: 1600, height_px: 720, perInch: 270 },
  "5.0 inches, 1920 x 1080": { width_px: 1920, height_px: 1080, perInch: 441 },
  "6.1 inches, 2532 x 1170": { width_px: 2532, height_px: 1170, perInch: 460 },
};

function screenOf({ width_px, height_px, perInch }: Phone): Screen {
  const toMetres = INCH_M / perInch;
  return { width_m: width_px * toMetres, height_m: height_px * toMetres, border_m: EDGE_M };
}

/**
 * Height on the phone, px, between two heights on a quad, px of the quad, whose middle is looked
 * at.
 */
function pixelsBetween(
  phone: Phone,
  profile: Profile,
  [x, upper, lower]: readonly [x: number, upper: number, lower: number],
  [width, height]: readonly [number, number],
): number {
  const screen = screenOf(phone);
  const at = (y: number) => {
    const right = (x - width / 2) / PX_PER_M / PANEL_DISTANCE_M;
    const up = (height / 2 - y) / PX_PER_M / PANEL_DISTANCE_M;
    const [across, along] = toScreen(profile, screen, "left", right, up);
    return [across * phone.width_px, along * phone.height_px] as const;
  };
  const [top, bottom] = [at(upper), at(lower)];
  return Math.hypot(top[0] - bottom[0], top[1] - bottom[1]);
}

type Surface = Readonly<{ name: string; size: readonly [number, number] }> &
  Pick<Page, "marks" | "regions">;

/** Every page of the menu, and every state of the bar. */
function surfaces(): readonly Surface[] {
  const lit = [
    { type: "notify", text: "a fault", isRetryable: true } as const,
    { type: "set", id: "mode", value: "traced" } as const,
  ].reduce(reduce, initialState(sampleManifest(12)));
  const found: Surface[] = [];
  for (const state of [initialState(sampleManifest(12)), lit]) {
    const facts = { ...STEREO_FACTS, split: { isAvailable: true, reason: "" } };
    const layout = buildPanel(state, facts, { ...START_VIEW, picked: "c2", isHistogramOpen: true });
    const opened = layout.sections.flatMap(({ id: tab, items }) => [
      { tab, group: null },
      ...items.flatMap(({ kind, id }) => (kind === "group" ? [{ tab, group: id }] : [])),
    ]);
    for (const where of [{ tab: null, group: null }, ...opened]) {
      const fanned = where.tab === "channels" ? "c1" : null;
      for (let page = 0, count = 1; page < count; page++) {
        const made = pageOf(layout, { ...START_CANVAS, ...where, page, fanned });
        count = made.count;
        const name = `${where.tab} ${where.group} ${page}`;
        found.push({ ...made, name, size: [WIDTH, HEIGHT] });
        const bar = barOf({ state, page: made, canUndo: true, lastMode: "disc" });
        found.push({ ...bar, name: `bar of ${name}`, size: [BAR_WIDTH, BAR_HEIGHT] });
      }
    }
    const bar = barOf({ state, page: null, canUndo: true, lastMode: "disc" });
    found.push({ ...bar, name: "bar", size: [BAR_WIDTH, BAR_HEIGHT] });
  }
  return found;
}

const ALL = surfaces();
const texts = ALL.flatMap(({ marks, size }) =>
  marks.flatMap((mark) => (isText(mark) ? [{ mark, size }] : [])),
);

function isText(mark: Mark): mark is Extract<Mark, { kind: "text" }> {
  return mark.kind === "text" && mark.text !== "";
}

const degrees = (px: number) =>
  (2 * Math.atan(px / PX_PER_M / 2 / PANEL_DISTANCE_M) * 180) / Math.PI;

/**
 * Palettes, tile maps and lists of choices count as one control each: they have a row or a page of
 * their own.
 */
const isField = (id: string) => /^tile-map=|\/(palette|color)=|-choice/.test(id);

describe("the panel in a Cardboard", () => {
  const rows: string[][] = [];
  const note = (figure: string, found: number, bound: number) => {
    rows.push([figure, found.toFixed(1), String(bound)]);
  };

  afterAll(() => writeTable("STEREOCELL_LEGIBILITY_TABLE", ["figure", "least", "at least"], rows));

  it("covers 55 x 40 degrees of the view", () => {
    expect(degrees(WIDTH)).toBeCloseTo(55, 0);
    expect(degrees(HEIGHT)).toBeCloseTo(40, 0);
  });

  it("has letters of at least 24 mm at 1 m", () => {
    expect(texts.length).toBeGreaterThan(300);
    const sizes_mm = texts.map(({ mark }) => (1000 * mark.size) / PX_PER_M / PANEL_DISTANCE_M);
    note("size of a letter, mm at 1 m", Math.min(...sizes_mm), 24);
    expect(Math.min(...sizes_mm)).toBeGreaterThanOrEqual(24);
  });

  it("has letters of at least 24 mm at 1 m in notices, even for three long ones", () => {
    const long = "A sentence that takes many words to say what is missing and what could be done.";
    const letters = noticeMarks([1, 2, 3].map((each) => `${each}. ${long}`)).filter(isText);
    expect(letters).toHaveLength(3);
    const least = Math.min(...letters.map(({ size }) => size));
    const size_mm = (1000 * least) / NOTICE_PX_PER_M / NOTICE_DISTANCE_M;
    note("size of a notice's letter, mm at 1 m", size_mm, 24);
    expect(size_mm).toBeGreaterThanOrEqual(24);
  });

  for (const [name, phone] of Object.entries(PHONES)) {
    for (const [lenses, profile] of Object.entries(BUILT_IN)) {
      it(`has letters with an x-height of at least 6 pixels: ${name}, Cardboard ${lenses}`, () => {
        const heights = texts.map(({ mark: { rect, size }, size: quad }) => {
          const middle = rect.y + rect.height / 2;
          const half = (X_HEIGHT * size) / 2;
          const at = [rect.x + rect.width / 2, middle - half, middle + half] as const;
          return pixelsBetween(phone, profile, at, quad);
        });
        note(`x-height, px: ${name}, Cardboard ${lenses}`, Math.min(...heights), 6);
        expect(Math.min(...heights)).toBeGreaterThanOrEqual(6);
      });
    }
  }

  it("has targets of at least 4.5 x 3 degrees", () => {
    const small = ALL.flatMap(({ name, regions }) =>
      regions
        .filter(({ rect: { width, height } }) => degrees(width) < 4.5 || degrees(height) < 3)
        .map(({ id }) => `${name}: ${id}`),
    );
    const rects = ALL.flatMap(({ regions }) => regions.map(({ rect }) => rect));
    const [widths, heights] = [rects.map(({ width }) => width), rects.map(({ height }) => height)];
    note("width of a target, degrees", degrees(Math.min(...widths)), 4.5);
    note("height of a target, degrees", degrees(Math.min(...heights)), 3);
    expect(small).toEqual([]);
  });

  it("has at most six targets on a page, counting a palette, map or list as one", () => {
    const counts = ALL.filter(({ name }) => !name.startsWith("bar")).map(({ name, regions }) => {
      const whole = new Set(regions.map(({ id }) => (isField(id) ? id.split("=")[0] : id)));
      const rows = [...whole].filter((id) => !/\/(open|more)$/.test(id));
      return [name, rows.length] as const;
    });
    expect(counts.filter(([, count]) => count > MAX_TARGETS)).toEqual([]);
  });

  it("keeps its targets apart and on the quad", () => {
    for (const { name, regions, size } of ALL) {
      for (const [i, { rect, id }] of regions.entries()) {
        expect(Math.min(rect.x, rect.y), `${name}: ${id}`).toBeGreaterThanOrEqual(0);
        expect(rect.x + rect.width, `${name}: ${id}`).toBeLessThanOrEqual(size[0]);
        expect(rect.y + rect.height, `${name}: ${id}`).toBeLessThanOrEqual(size[1]);
        const others = regions.slice(i + 1).filter((other) => doOverlap(rect, other.rect));
        expect(others.map((other) => `${name}: ${id} ${other.id}`)).toEqual([]);
      }
    }
  });
});

function doOverlap(a: Rect, b: Rect): boolean {
  const across = Math.min(a.x + a.width, b.x + b.width) - Math.max(a.x, b.x);
  const along = Math.min(a.y + a.height, b.y + b.height) - Math.max(a.y, b.y);
  return Math.min(across, along) > 1e-6;
}
