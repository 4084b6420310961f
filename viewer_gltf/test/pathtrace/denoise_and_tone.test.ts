/** Compares each pixel of the finished frame with the value that follows from the gathered sums. */
import { expect, it } from "vitest";
import type { TraceSettings } from "../../src/state/path_trace_settings";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { sweep } from "../support/exhaustive";
import type { Gathered, Harness, Run } from "../support/pathtrace/harness";
import { BASE } from "../support/pathtrace/phantom";

/** Number of samples from which no pixel is denoised. */
const PASSES = 192;
const RUN: Run = { ...BASE, color: [0.9, 0.55, 0.3], passes: PASSES, pixels: 20 };
/** Largest difference, of 255; the mean is stored in half-precision floats, and the frame in bytes. */
const SLACK = 1.5;

type Rgb = [number, number, number];
const each = (f: (k: 0 | 1 | 2) => number): Rgb => [f(0), f(1), f(2)];
const clamp = (v: number) => Math.min(1, Math.max(0, v));

const srgb = (v: number) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const film = (v: number) => clamp((v * (2.51 * v + 0.03)) / (v * (2.43 * v + 0.59) + 0.14));

/** Changes hue (degrees), saturation and lightness by the definitions of CSS (css-color-4, section 7). */
function changed(rgb: Rgb, turn_deg: number, factor: number, lighter: number): Rgb {
  const [high, low] = [Math.max(...rgb), Math.min(...rgb)];
  const [r, g, b] = rgb;
  const lightness = (high + low) / 2;
  const saturation = high === low ? 0 : (high - lightness) / Math.min(lightness, 1 - lightness);
  const sixth =
    high === low
      ? 0
      : high === r
        ? (g - b) / (high - low) + (g < b ? 6 : 0)
        : high === g
          ? (b - r) / (high - low) + 2
          : (r - g) / (high - low) + 4;
  const [h, s, l] = [60 * sixth + turn_deg, clamp(saturation * factor), clamp(lightness + lighter)];
  const at = (n: number) => {
    const k = (((n + h / 30) % 12) + 12) % 12;
    return l - s * Math.min(l, 1 - l) * Math.max(-1, Math.min(k - 3, 9 - k, 1));
  };
  return [at(0), at(8), at(4)];
}

/** Returns the expected frame, 0..255, premultiplied. */
function expectedOf({ sums, moments }: Gathered, s: TraceSettings, n = RUN.pixels): number[] {
  const mean = (x: number, y: number): readonly [Rgb, number] => {
    const i = 4 * (n * y + x);
    const covered = sums[i + 3];
    const open = covered > 0 ? 1 + s.occlusion * (moments[i + 3] / covered - 1) : 1;
    return [each((k) => (sums[i + k] / moments[i + 1]) * open), covered / moments[i + 1]];
  };
  const clip = (v: number) => Math.min(n - 1, Math.max(0, v));
  const picture: number[] = [];
  for (let y = 0; y < n; y++) {
    for (let x = 0; x < n; x++) {
      const [here, coverage] = mean(x, y);
      if (coverage === 0) {
        picture.push(0, 0, 0, 0);
        continue;
      }
      const blurred: Rgb = [0, 0, 0];
      for (const [dx, a] of [
        [-1, 1],
        [0, 2],
        [1, 1],
      ]) {
        for (const [dy, b] of [
          [-1, 1],
          [0, 2],
          [1, 1],
        ]) {
          const [there] = mean(clip(x + dx), clip(y + dy));
          there.forEach((v, k) => {
            blurred[k] += (a * b * v) / 16;
          });
        }
      }
      const sharp = each((k) => Math.max(0, here[k] + s.sharpness * (here[k] - blurred[k])));
      const light = each((k) => (2 ** s.exposure * sharp[k]) / coverage);
      const shown = each((k) => srgb(s.toneMap === "filmic" ? film(light[k]) : clamp(light[k])));
      const toned = changed(shown, s.hue, s.saturation, s.lightness);
      picture.push(...toned.map((v) => 255 * clamp(v) * coverage), 255 * coverage);
    }
  }
  return picture;
}

const PLAIN: Partial<TraceSettings> = {
  exposure: 0,
  toneMap: "none",
  hue: 0,
  saturation: 1,
  lightness: 0,
  occlusion: 0,
  sharpness: 0,
};
const ALL: Partial<TraceSettings> = {
  exposure: -0.7,
  toneMap: "filmic",
  hue: -50,
  saturation: 1.7,
  lightness: 0.06,
  occlusion: 0.8,
  sharpness: 0.9,
};

describeInChromium("the adjustments after path tracing", () => {
  const { call } = prepareBarePage<Harness>(
    new URL("../support/pathtrace/harness.ts", import.meta.url),
  );
  const gather = (settings: Partial<TraceSettings>, change: Partial<Run> = {}) =>
    call("gather", { ...RUN, settings, ...change });

  const settings = [
    ["nothing, where all is at rest", PLAIN],
    ["exposure", { ...PLAIN, exposure: 1.3 }],
    ["the curve of film", { ...PLAIN, toneMap: "filmic" }],
    ["hue", { ...PLAIN, hue: 110 }],
    ["saturation and lightness", { ...PLAIN, saturation: 0.4, lightness: -0.1 }],
    ["occlusion", { ...PLAIN, occlusion: 1 }],
    ["sharpness", { ...PLAIN, sharpness: 1.5 }],
    ["all of them", ALL],
  ] as const;
  it.each(sweep(settings, ([, each]) => each === PLAIN || each === ALL))(
    "change each pixel as computed here: %s",
    async (_, settings) => {
      const found = await gather(settings);
      const expected = expectedOf(found, { ...settings } as TraceSettings);
      const plain = expectedOf(found, { ...PLAIN } as TraceSettings);
      let [worst, change, drawn] = [0, 0, 0];
      expected.forEach((v, i) => {
        worst = Math.max(worst, Math.abs(v - found.picture[i]));
        change = Math.max(change, Math.abs(v - plain[i]));
        if (v > 20) drawn++;
      });
      expect(worst).toBeLessThan(SLACK);
      expect(drawn).toBeGreaterThan(150);
      if (settings !== PLAIN) expect(change).toBeGreaterThan(3 * SLACK);
    },
  );

  it("have no effect if they are off, and never change the gathered light", async () => {
    const off = await gather({ ...ALL, isPostOn: false });
    const plain = await gather(PLAIN);
    expect(off.picture).toEqual(plain.picture);
    expect(off.sums).toEqual(plain.sums);
  });

  it("remove noise from a frame with few samples", async () => {
    const pixels = 48;
    const { picture: many } = await gather(PLAIN, { pixels, passes: 256 });
    const apart = (picture: readonly number[]) =>
      Math.hypot(...picture.map((v, i) => v - many[i])) / Math.sqrt(many.length);
    for (const passes of [1, 4]) {
      const few = await gather(PLAIN, { pixels, passes });
      const raw = expectedOf(few, { ...PLAIN } as TraceSettings, pixels);
      expect(apart(few.picture), `${passes} samples`).toBeLessThan(0.92 * apart(raw));
    }
  });
});
