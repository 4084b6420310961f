/**
 * A path-traced frame looks the same at rest and while the view moves, when a ray-marched frame stands in for it. This
 * is checked for five values of every number of the light. STEREOCELL_MOVING_TABLE names a file for the table of
 * differences.
 */
import { writeFile } from "node:fs/promises";
import { afterAll, expect, it } from "vitest";
import { valueAtShare } from "../../src/state/parameters/kinds";
import { LIGHT_NUMBERS, START_LIGHT } from "../../src/state/parameters/light";
import { START_TRACE, type TraceSettings } from "../../src/state/path_trace_settings";
import { prepareBarePage } from "../support/browser/bare_page";
import type { Pixel } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { colorDifference, toLab } from "../support/color_difference";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { BASE, opacityRamp } from "../support/pathtrace/phantom";
import type { Harness, Pair, View } from "../support/pathtrace/stand_in";

/** Largest difference of the mean colours, CIEDE2000. */
const MAX_DELTA_E = 6;
/** Colour of the page behind the specimen. */
const BACKGROUND: Pixel = [11, 13, 18];

/** Edge of a block of pixels whose mean is compared. */
const BLOCK = 4;

/** An environment that is bright above and dim below, with a window on one side. */
const WINDOW_ENVIRONMENT = {
  width: 4,
  height: 2,
  rgb: [...[1, 1.1, 1.3], ...[6, 5.5, 5], ...[1, 1.1, 1.3], ...[1.2, 1.2, 1.2]].concat(
    new Array<number>(12).fill(0.3),
  ),
};

type Specimen = Readonly<{ name: string; view: Partial<View> }>;
const GREEN: Specimen = { name: "green mist", view: { color: [0.12, 0.7, 0.25] } };
const SKIN: Specimen = {
  name: "beige skin",
  view: {
    color: [0.85, 0.62, 0.45],
    opacities: opacityRamp(255).map((_, i) => (i < 60 ? 0 : Math.min(255, 4 * (i - 60)))),
  },
};

function viewOf({ view }: Specimen, settings: Partial<TraceSettings>, pixels = 16): View {
  return { ...BASE, environment: WINDOW_ENVIRONMENT, passes: 64, pixels, ...view, settings };
}

/** Returns a pixel over the background, sRGB-encoded like on the page. */
function overBackground(rgba: readonly number[]): Pixel {
  const linear = (v: number) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  const encoded = (v: number) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
  const alpha = rgba[3] / 255;
  const shown = BACKGROUND.map((behind, k) => {
    const light = alpha > 0 ? linear(Math.min(1, rgba[k] / rgba[3])) * alpha : 0;
    return 255 * encoded(light + (1 - alpha) * linear(behind / 255));
  });
  return [shown[0], shown[1], shown[2]];
}

/** Mean colours of both pictures over the pixels that show the specimen in both, or in neither. */
function meansOf({ moving, resting }: Pair, isSpecimen: boolean): readonly [Pixel, Pixel] {
  const pixels = moving.length / 4;
  const chosen = Array.from({ length: pixels }, (_, i) => i).filter(
    (i) => moving[4 * i + 3] > 0 === isSpecimen && resting[4 * i + 3] > 0 === isSpecimen,
  );
  const mean = (picture: readonly number[]): Pixel => {
    const sum = [0, 0, 0];
    for (const i of chosen) {
      overBackground(picture.slice(4 * i, 4 * i + 4)).forEach((v, k) => {
        sum[k] += v / chosen.length;
      });
    }
    return [sum[0], sum[1], sum[2]];
  };
  return [mean(moving), mean(resting)];
}

/** Mean colours of blocks of 4 x 4 pixels. */
function blocksOf(picture: readonly number[], pixels: number): Pixel[] {
  const blocks = pixels / BLOCK;
  return Array.from({ length: blocks ** 2 }, (_, b): Pixel => {
    const sum = [0, 0, 0];
    for (let k = 0; k < BLOCK ** 2; k++) {
      const x = BLOCK * (b % blocks) + (k % BLOCK);
      const y = BLOCK * Math.floor(b / blocks) + Math.floor(k / BLOCK);
      const i = 4 * (y * pixels + x);
      overBackground(picture.slice(i, i + 4)).forEach((v, c) => {
        sum[c] += v / BLOCK ** 2;
      });
    }
    return [sum[0], sum[1], sum[2]];
  });
}

const hasPixels = ([mean]: readonly [Pixel, Pixel]) => mean.some((v) => v > 0);

describeInChromium("while the view moves the stand-in", () => {
  const { call } = prepareBarePage<Harness>(
    new URL("../support/pathtrace/stand_in.ts", import.meta.url),
  );
  const lines: string[] = [];

  async function differenceOf(name: string, view: View): Promise<number> {
    const pair = await call("pair", view);
    const specimen = meansOf(pair, true);
    if (!hasPixels(specimen)) return 0; // neither frame shows anything of the specimen
    const [moving, resting] = specimen.map(toLab);
    const found = colorDifference(moving, resting);
    const sky = meansOf(pair, false);
    const behind = hasPixels(sky) ? colorDifference(toLab(sky[0]), toLab(sky[1])) : 0;
    const rgb = specimen.map((mean) => mean.map(Math.round).join(", "));
    lines.push(`| ${name} | ${rgb[0]} | ${rgb[1]} | ${found.toFixed(1)} | ${behind.toFixed(1)} |`);
    expect.soft(behind, `${name}: the background`).toBeLessThan(1);
    return found;
  }

  afterAll(async () => {
    const file = process.env.STEREOCELL_MOVING_TABLE;
    if (file === undefined) return;
    const head =
      "| slider | moving, mean sRGB | at rest, 64 samples | difference (CIEDE2000) | background |";
    await writeFile(file, `${[head, "|---|---|---|---|---|", ...lines].join("\n")}\n`);
  });

  const isWhole = IS_EXHAUSTIVE || process.env.STEREOCELL_MOVING_TABLE !== undefined;
  /** Places along a slider, 0..1. */
  const sharesOf = (row: number) => (isWhole ? [0, 0.25, 0.5, 0.75, 1] : [row % 2 ? 0.25 : 0.75]);
  const specimens = isWhole ? [GREEN, SKIN] : [GREEN];
  const traced = { ...START_LIGHT, mode: "traced" as const };
  const rows = LIGHT_NUMBERS.filter(({ id }) => !/lamp-[12]/.test(id));
  for (const [number, row] of rows.entries()) {
    it(`looks like the frame at rest for any ${row.link}`, async () => {
      for (const specimen of specimens) {
        for (const share of sharesOf(number)) {
          const value = valueAtShare(row, share);
          const { trace } = row.set(traced, value);
          const text = row.text(value);
          const name = `${row.id.replace("trace/", "")} ${text}, ${specimen.name}`;
          const found = await differenceOf(name, viewOf(specimen, trace));
          expect.soft(found, name).toBeLessThan(MAX_DELTA_E);
        }
      }
    });
  }

  it("looks like the frame at rest for any cut", async () => {
    for (const specimen of specimens) {
      for (const right of isWhole ? [10, 14, 18, 22, 26] : [14]) {
        const view = { ...viewOf(specimen, START_TRACE), cut: [0, right] as const };
        const name = `cut at ${right} um, ${specimen.name}`;
        expect.soft(await differenceOf(name, view), name).toBeLessThan(MAX_DELTA_E);
      }
    }
  });

  it("looks like the frame at rest with and without the adjustments after tracing", async () => {
    const lamps = START_TRACE.lamps.map((lamp) => ({ ...lamp, isOn: true }));
    const others: [string, Partial<TraceSettings>][] = [
      ["no tone map", { toneMap: "none" }],
      ["before", { isPostOn: false }],
      ["scattered once", { isMultiple: false }],
      ["three lamps", { lamps }],
      ["no lamp", { lamps: lamps.map((lamp) => ({ ...lamp, isOn: false })) }],
    ];
    for (const specimen of specimens) {
      for (const [what, settings] of others) {
        const name = `${what}, ${specimen.name}`;
        const found = await differenceOf(name, viewOf(specimen, settings));
        expect.soft(found, name).toBeLessThan(MAX_DELTA_E);
      }
    }
  });

  const MANY = 32;
  const RED_LAMP = { ...START_TRACE.lamps[0], color: [1, 0, 0] as const };
  const CHANGES: [string, Partial<TraceSettings>][] = [
    ["transmission", { bias: 0.25 }],
    ["the light", { environmentLight: 0, lamps: [RED_LAMP] }],
    ["hue", { hue: 90 }],
  ];
  for (const [name, settings] of CHANGES) {
    it(`shows another value of ${name} in the whole next frame`, async () => {
      const view = { ...viewOf(SKIN, {}, MANY), passes: 32 };
      const { before, frames, after } = await call("change", view, settings);
      const blocks = blocksOf(before, MANY).flatMap((was, i) => {
        const is = blocksOf(after, MANY)[i];
        return colorDifference(toLab(was), toLab(is)) > 12 ? [{ i, was, is }] : [];
      });
      expect(blocks.length).toBeGreaterThan(8);
      frames.forEach((frame, k) => {
        const shown = blocksOf(frame, MANY);
        const stale = blocks.filter(({ i, was, is }) => {
          const [old, now, here] = [was, is, shown[i]].map(toLab);
          return colorDifference(here, old) < colorDifference(here, now);
        });
        expect.soft(stale.length, `stale blocks in frame ${k} of ${blocks.length}`).toBe(0);
      });
    });
  }
});
