/**
 * Compares the path tracer with known results, for all sizes of bricks and all distributions of samples. A medium
 * without absorption vanishes in a white room, light fades by the law of Beer and Lambert, and another path tracer,
 * tests/support/reference_path_tracer.py, gathers the same light. Adjustments after tracing are tested in
 * denoise_and_tone.test.ts.
 */
import { describe, expect, it } from "vitest";
import { SKIP_BRICK } from "../../src/bundle/generated/constants";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { IS_EXHAUSTIVE, sweep } from "../support/exhaustive";
import type { Gathered, Harness, Run } from "../support/pathtrace/harness";
import { BASE, opacityRamp, SIZE } from "../support/pathtrace/phantom";
import { askPython, hasPython } from "../support/python";

/** Edge of a tile, pixels; a tile is sampled as a whole or skipped. */
const NOISE_TILE = 16;

/** Edges of the bricks of majorants, texels. */
const BRICKS = [SKIP_BRICK, 2 * SKIP_BRICK, 4 * SKIP_BRICK];

/** Number of paths of the reference, with which its standard errors are below 1 %. */
const PATHS = 600_000;

const luminanceOf = ([r, g, b]: readonly number[]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;
const mean = (values: readonly number[]) => values.reduce((a, b) => a + b, 0) / values.length;

type Estimate = Readonly<{ mean: number; error: number }>;

/** Returns the mean luminance of the frame, and its standard error from the variance of each pixel. */
function brightness({ sums, moments }: Gathered): Estimate {
  const pixels = sums.length / 4;
  let [sum, variance] = [0, 0];
  for (let i = 0; i < pixels; i++) {
    const n = moments[4 * i + 1];
    const luminance = luminanceOf(sums.slice(4 * i, 4 * i + 3)) / n;
    sum += luminance;
    variance += Math.max(0, moments[4 * i] / n - luminance ** 2) / (n - 1);
  }
  return { mean: sum / pixels, error: Math.sqrt(variance) / pixels };
}

/** Returns the mean coverage of the frame, and its standard error. */
function coverage({ sums, moments }: Gathered): Estimate {
  const pixels = sums.length / 4;
  let [sum, variance] = [0, 0];
  for (let i = 0; i < pixels; i++) {
    const n = moments[4 * i + 1];
    const share = sums[4 * i + 3] / n;
    sum += share;
    variance += (share * (1 - share)) / (n - 1);
  }
  return { mean: sum / pixels, error: Math.sqrt(variance) / pixels };
}

function expectAlike(a: Estimate, b: Estimate, what: string): void {
  const apart = Math.abs(a.mean - b.mean) / Math.hypot(a.error, b.error);
  expect(apart, `${what}: ${a.mean} beside ${b.mean}, in standard errors`).toBeLessThan(3);
}

const samplesOf = ({ moments }: Gathered) => moments.filter((_, i) => i % 4 === 1);

async function reference(run: Run, paths: number): Promise<{ mean: number[]; error: number[] }> {
  const asked = JSON.stringify({ ...run, paths, seed: 1 });
  return JSON.parse(await askPython("reference_path_tracer", [], asked));
}

describeInChromium("the path tracer", () => {
  const { call } = prepareBarePage<Harness>(
    new URL("../support/pathtrace/harness.ts", import.meta.url),
  );
  const gather = (run: Run) => call("gather", run);

  /** Other forms in which the same medium can be given. */
  const MEDIUM_FORMS = [
    ["by value and gradient", { isTwoD: true }],
    ["in bricks", { isBricked: true }],
    ["in bricks by value and gradient", { isBricked: true, isTwoD: true }],
    ["as four channels", { channels: 4 }],
    ["as two channels by value and gradient", { channels: 2, isTwoD: true }],
  ] as const satisfies readonly (readonly [string, Partial<Run>])[];

  const swallowsNothing = [
    ["scattering forward", { surface: 0, anisotropy: 0.6 }, {}],
    ["with surfaces that shine", { surface: 0.7, shine: 1 }, {}],
    ...MEDIUM_FORMS.slice(3).map(([name, form]) => [name, { surface: 0.4 }, form] as const),
  ] as const;
  for (const [name, settings, form] of sweep(
    swallowsNothing,
    ([, { surface }, form]) => surface === 0.7 || "isTwoD" in form,
  )) {
    it(`makes a medium without absorption vanish in a white room: ${name}`, async () => {
      const passes = Object.keys(form).length > 0 ? 96 : 256;
      const pixels = 20;
      const { sums } = await gather({ ...BASE, ...form, settings, passes, pixels });
      const found: number[] = [];
      for (let i = 0; i < sums.length; i += 4) {
        if (sums[i + 3] < 0.2 * passes) continue;
        const behind = passes - sums[i + 3]; // the background is white, too
        found.push(mean(sums.slice(i, i + 3).map((v) => (v + behind) / passes)));
      }
      expect(found.length).toBeGreaterThan(80);
      expect(Math.abs(mean(found) - 1)).toBeLessThan(0.01);
    });
  }

  it("also makes it vanish while the view moves, since the environment replaces the rest of short paths", async () => {
    const dense: Run = { ...BASE, opacities: opacityRamp(250), isDraft: true };
    const { sums } = await gather({ ...dense, settings: { surface: 0 }, passes: 64 });
    const found: number[] = [];
    for (let i = 0; i < sums.length; i += 4) {
      if (sums[i + 3] > 60) found.push(mean(sums.slice(i, i + 3)) / sums[i + 3]);
    }
    expect(found.length).toBeGreaterThan(100);
    expect(Math.abs(mean(found) - 1)).toBeLessThan(0.01);
  });

  describe("lets light through a slab by Beer and Lambert's law", () => {
    const far: Run = {
      ...BASE,
      spacing_um: [1, 1, 1],
      // The eye is far away, so that all rays are parallel to z.
      camera: { eye: [16, -16, 64_000], target: [16, -16, 16], fov_deg: 0.02 },
      settings: { isMultiple: false },
    };
    const AXIS = Array.from({ length: SIZE[2] }, (_, i) => i);
    /** Texels of a slab from its intensities along z; the first and the last one are the apron. */
    const slab = (intensities: readonly number[]) =>
      intensities.flatMap((value) => new Array<number>(SIZE[0] * SIZE[1]).fill(value));

    const isAsExpected = (found: Gathered, expected: number) => {
      const { mean: share } = coverage(found);
      const count = samplesOf(found).reduce((a, b) => a + b, 0);
      const error = Math.sqrt((expected * (1 - expected)) / count);
      expect(Math.abs(1 - share - expected) / error).toBeLessThan(3);
    };

    it("that is homogeneous", async () => {
      const opacity = 20;
      const opacities = new Array<number>(256).fill(opacity);
      const texels = slab(AXIS.map(() => 255));
      const expected = (1 - opacity / 255) ** 32; // 32 voxels of 1 um
      isAsExpected(await gather({ ...far, texels, opacities }), expected);
    });

    for (const [name, form] of sweep(MEDIUM_FORMS, ([, form]) => !("isTwoD" in form))) {
      it(`given ${name}`, async () => {
        const { channels = 1 }: Partial<Run> = form;
        const opacity = 20; // opacity of one channel, 8 bits; equal channels share it
        const share = Math.round(255 * (1 - (1 - opacity / 255) ** (1 / channels)));
        const opacities = new Array<number>(256).fill(opacity);
        const texels = slab(AXIS.map(() => 255));
        const expected = (1 - share / 255) ** (32 * channels);
        isAsExpected(await gather({ ...far, ...form, texels, opacities }), expected);
      });
    }

    // The intensities are steep and wavy, so that bricks of each size have different majorants.
    const intensities = AXIS.map((k) =>
      Math.round((k / 34) ** 2 * 115 * (1.2 + Math.sin(1.1 * k))),
    );
    const opacities = opacityRamp(90);
    let depth = 0;
    const STEPS = 64_000;
    for (let i = 0; i < STEPS; i++) {
      const z = 1 + (32 * (i + 0.5)) / STEPS;
      const between = (values: readonly number[], at: number) => {
        const left = Math.min(values.length - 2, Math.floor(at));
        return values[left] + (values[left + 1] - values[left]) * (at - left);
      };
      const extinctions = opacities.map((opacity) => -Math.log(1 - opacity / 255));
      depth += (between(extinctions, between(intensities, z)) * 32) / STEPS;
    }
    for (const brick of sweep(BRICKS, (each) => each === BRICKS[0])) {
      it(`that becomes denser inwards, with bricks of ${brick}`, async () => {
        const texels = slab(intensities);
        const run = { ...far, texels, opacities, brick, passes: 128 };
        isAsExpected(await gather(run), Math.exp(-depth));
      });
    }
  });

  it("lights the cut face of a homogeneous medium like a matt surface of its colour", async () => {
    const color = [0.6, 0.6, 0.6] as const;
    const { sums } = await gather({
      ...BASE,
      color,
      texels: new Array<number>(SIZE[0] * SIZE[1] * SIZE[2]).fill(255),
      opacities: new Array<number>(256).fill(250),
      camera: { eye: [16, -16, 64_000], target: [16, -16, 16], fov_deg: 0.02 },
    });
    const coverage = mean(sums.filter((_, i) => i % 4 === 3));
    const light = mean(sums.filter((_, i) => i % 4 === 0)) / coverage;
    expect(Math.abs(light - 0.6)).toBeLessThan(0.02);
  });

  it("gives the same coverage for all sizes of bricks", async () => {
    const [small, ...larger] = sweep(BRICKS, (brick) => brick !== 2 * SKIP_BRICK);
    const found = coverage(await gather({ ...BASE, brick: small }));
    for (const brick of larger) {
      const other = coverage(await gather({ ...BASE, brick }));
      expectAlike(found, other, `bricks of ${small} and of ${brick}`);
    }
  });

  it("samples tiles in turn, so that each pixel has one sample after a round", async () => {
    const run: Run = { ...BASE, pixels: 64 };
    const half = await gather({ ...run, share: 1 / 4, passes: 2 });
    expect(new Set(samplesOf(half))).toEqual(new Set([0, 1]));
    expect(half.picture.every((v) => v === 0)).toBe(true); // half of a round is not shown
    for (const [share, passes] of [
      [1 / 4, 4],
      [1 / 16, 16],
    ]) {
      const whole = await gather({ ...run, share, passes });
      expect(new Set(samplesOf(whole)), `${share}`).toEqual(new Set([1]));
      expect(whole.samples).toBe(1);
      expect(whole.picture.some((v) => v > 0)).toBe(true);
    }
  });

  describe("distributes its samples", () => {
    const passes = 64;
    const run: Run = { ...BASE, pixels: 80, passes, color: [0.9, 0.7, 0.5] };

    /** Mean samples of each tile, and the standard error of its pixels' luminance. */
    function tiles(found: Gathered) {
      const across = run.pixels / NOISE_TILE;
      const sorted = Array.from({ length: across ** 2 }, () => [] as number[]);
      samplesOf(found).forEach((_, i) => {
        const [x, y] = [i % run.pixels, Math.floor(i / run.pixels)];
        sorted[Math.floor(y / NOISE_TILE) * across + Math.floor(x / NOISE_TILE)].push(i);
      });
      return sorted.map((pixels) => ({
        samples: mean(pixels.map((i) => found.moments[4 * i + 1])),
        isEmpty: pixels.every((i) => found.sums[4 * i + 3] === 0),
      }));
    }

    it("by the noise of the tiles, without changing the mean", async () => {
      const even = await gather(run);
      const adaptive = await gather({ ...run, calm: 0.02 });
      expect(tiles(even).every(({ samples }) => samples === passes)).toBe(true);
      const found = tiles(adaptive);
      const empty = found.filter(({ isEmpty }) => isEmpty);
      const drawn = found.filter(({ isEmpty }) => !isEmpty);
      expect(empty.length).toBeGreaterThan(3);
      // After two measurements of the noise, calm tiles are sampled in an eighth of the passes.
      expect(mean(empty.map(({ samples }) => samples))).toBeLessThan(16 + 0.25 * (passes - 16));
      expect(Math.max(...drawn.map(({ samples }) => samples))).toBeGreaterThan(0.9 * passes);
      expect(mean(drawn.map(({ samples }) => samples))).toBeGreaterThan(
        1.5 * mean(empty.map(({ samples }) => samples)),
      );
      expectAlike(brightness(adaptive), brightness(even), "brightness");
      expectAlike(coverage(adaptive), coverage(even), "coverage");
    });
  });

  describe("carries gathered samples to the moved view", () => {
    // A pixel shows 0.8 um at the centre, and eyes may tremble by 0.53 um.
    const still: Run = { ...BASE, color: [0.9, 0.7, 0.5], pixels: 48, passes: 64 };

    it("while the eye trembles, without losing any", async () => {
      const tremble = [
        [0, 0, 0],
        [-0.2, 0.3, 0.05],
        [0.1, -0.25, 0],
        [0.36, 0.24, -0.1],
      ];
      const fresh = await gather(still);
      const trembling = await gather({ ...still, asides: tremble });
      expect(trembling.sums).toEqual(fresh.sums);
      expect(trembling.moments).toEqual(fresh.moments);
      expect(trembling.picture).not.toEqual(fresh.picture);
    });

    it("and shows each point where the moved eye sees it, also between pixels", async () => {
      // A slanted disc is in front of an empty background. Its colour grows with x and y, and its rim is a circle.
      const [pixels, fov_deg, radius] = [64, 24, 14];
      const unit = 2 * Math.tan((fov_deg * Math.PI) / 360);
      type Eye = [number, number, number];
      /** Returns the place at which a pixel's ray meets the disc's plane, z = x / 3, and its distance. */
      const meet = ([ex, ey, ez]: Eye, i: number) => {
        const across = [i % pixels, Math.floor(i / pixels)].map(
          (k) => unit * ((k + 0.5) / pixels - 0.5),
        );
        const t = (ez - ex / 3) / (1 + across[0] / 3);
        const [x, y] = [ex + t * across[0], ey + t * across[1]];
        return { x, y, away_um: t * Math.hypot(across[0], across[1], 1) };
      };
      const from: Eye = [0, 0, 90];
      const pixelsOf = (eye: Eye) =>
        Array.from({ length: pixels ** 2 }, (_, i) => {
          const { x, y, away_um } = meet(eye, i);
          const brim = Math.hypot(x, y) - radius;
          const isMet = brim < 0;
          return {
            color: isMet ? [0.5 + x / 40, 0.5 + y / 40, 1, 1] : [0, 0, 0, 0],
            away_um,
            brim,
          };
        });
      const before = pixelsOf(from);
      const given = {
        pixels,
        fov_deg,
        from,
        away_um: before.map(({ away_um, brim }) => (brim < 0 ? away_um : 0)),
        colors: before.flatMap(({ color }) => color),
        size_um: [40, 40, 10] as const,
      };
      for (const to of [[0.5, 0, 90], [-0.3, 0.4, 90.2], [2, -1.5, 89], from] as Eye[]) {
        const found = await call("warp", { ...given, to });
        const expected = pixelsOf(to);
        let [worst, moved] = [0, 0];
        expected.forEach(({ color, brim }, i) => {
          if (Math.abs(brim) < 1) return; // two pixels
          color.forEach((v, k) => {
            worst = Math.max(worst, Math.abs(v - found[4 * i + k]));
            moved = Math.max(moved, Math.abs(v - before[i].color[k]));
          });
        });
        expect(worst, `${to}`).toBeLessThan(to === from ? 1e-5 : 0.002);
        if (to !== from) expect(moved).toBeGreaterThan(0.007);
      }
    });

    it.runIf(IS_EXHAUSTIVE)("while the eye sways slowly, up to a limit", async () => {
      const sway = Array.from({ length: 64 }, (_, i) => [0.1 * Math.min(i, 63 - i), 0, 0]);
      const fresh = await gather(still);
      const swayed = await gather({ ...still, asides: sway });
      const hitPixels = (found: Gathered, share: number) =>
        Array.from({ length: still.pixels ** 2 }, (_, i) => i).filter(
          (i) => found.sums[4 * i + 3] >= share * found.moments[4 * i + 1],
        );
      const counts = hitPixels(fresh, 0.5).map((i) => swayed.moments[4 * i + 1]);
      expect(counts.length).toBeGreaterThan(100);
      expect(mean(counts)).toBeGreaterThan(16);
      // At most 48 samples are carried over, and those of the last place are added.
      expect(Math.max(...counts)).toBeLessThan(56);
      // The mean stays the same. Neighbouring pixels share samples, so the error is estimated for 32 samples.
      const few = {
        ...fresh,
        moments: fresh.moments.map((v) => v / 2),
        sums: fresh.sums.map((v) => v / 2),
      };
      for (const estimate of [brightness, coverage]) {
        const { error } = estimate(few); // for 32 samples
        expectAlike({ mean: estimate(swayed).mean, error }, estimate(fresh), estimate.name);
      }
    });

    it("but restarts if the eye really moves", async () => {
      const asides = [...new Array<number[]>(15).fill([0, 0, 0]), [5, 0, 0]];
      const moved = await gather({ ...still, passes: 16, asides });
      expect(new Set(samplesOf(moved))).toEqual(new Set([1]));
      expect(moved.samples).toBe(1);
    });
  });

  it("finds the bottom of a pit less open than a face", async () => {
    // The medium is dense up to z = 54, with a pit 3 wide and 24 deep at its centre, seen from above.
    const [n, depth, top] = [23, 67, 54];
    const texels = Array.from({ length: n * n * depth }, (_, i) => {
      const [x, y, z] = [i % n, Math.floor(i / n) % n, Math.floor(i / n ** 2)];
      const isPit = Math.abs(x - 11) <= 1 && Math.abs(y - 11) <= 1 && z > top - 24;
      return z === 0 || z > top || isPit ? 0 : 255;
    });
    const found = await gather({
      ...BASE,
      size: [n, n, depth],
      texels,
      spacing_um: [1, 1, 1],
      opacities: opacityRamp(250),
      color: [0.8, 0.8, 0.8],
      settings: { surface: 1, shine: 0 },
      // The view shows 16 um at the centre.
      camera: { eye: [10, -10, 6000], target: [10, -10, 20], fov_deg: 0.153 },
    });
    const openness = (isThere: (away_um: number) => boolean) => {
      let [open, hits] = [0, 0];
      samplesOf(found).forEach((_, i) => {
        const [x, y] = [i % 32, Math.floor(i / 32)].map((v) => Math.abs((v - 15.5) / 2));
        if (!isThere(Math.max(x, y))) return;
        open += found.moments[4 * i + 3];
        hits += found.sums[4 * i + 3];
      });
      return open / hits;
    };
    const [ground, face] = [openness((um) => um < 1), openness((um) => um > 4)];
    expect(face).toBeGreaterThan(0.85);
    expect(ground).toBeLessThan(0.85 * face);
  });

  describe.skipIf(!hasPython)("beside another path tracer", () => {
    const lit: Run = {
      ...BASE,
      color: [0.9, 0.75, 0.6],
      passes: 192,
      batches: 16,
      settings: {
        surface: 0.5,
        shine: 0.8,
        anisotropy: 0.4,
        environmentLight: 0.7,
        lamps: [
          { isOn: true, x: -0.9, y: 0.9, z: 1.1, color: [1, 0.5, 0.25], strength: 2 },
          { isOn: true, x: 1.2, y: -0.4, z: 0.3, color: [0.2, 0.4, 1], strength: 1 },
        ],
      },
      environment: {
        width: 4,
        height: 2,
        rgb: [
          0.2, 0.4, 4, 1, 0, 0, 0.1, 0.1, 0.1, 0, 3, 0, 0, 0, 0, 0.5, 0.2, 0.1, 0.3, 0.3, 0.3, 1, 1,
          0,
        ],
      },
    };
    const scattered = [
      ["many times", lit.settings],
      ["once", { ...lit.settings, isMultiple: false, anisotropy: -0.3, surface: 0.9 }],
      [
        "once, by three bright lamps on what shines",
        {
          ...lit.settings,
          isMultiple: false,
          surface: 1,
          shine: 1,
          environmentLight: 0,
          lamps: [
            { isOn: true, x: -0.9, y: 0.9, z: 1.1, color: [1, 0.5, 0.25], strength: 10 },
            { isOn: true, x: 1.2, y: -0.4, z: 0.9, color: [0.2, 0.4, 1], strength: 10 },
            { isOn: true, x: 0.1, y: 0.2, z: 1.4, color: [1, 1, 1], strength: 10 },
          ],
        },
      ],
    ] as const;
    for (const [name, settings] of sweep(scattered, ([name]) => name === "many times")) {
      it(`gathers the same light, scattered ${name}`, async () => {
        const run = { ...lit, settings };
        const [{ batches }, theirs] = await Promise.all([gather(run), reference(run, PATHS)]);
        const each = run.passes / batches.length;
        for (let k = 0; k < 4; k++) {
          const parts = batches.map((batch) => batch[k] / each);
          const squares = parts.map((v) => (v - mean(parts)) ** 2);
          const error = Math.sqrt(mean(squares) / (parts.length - 1));
          const other = { mean: theirs.mean[k], error: theirs.error[k] };
          expect(other.error).toBeLessThan(0.01 * other.mean);
          expectAlike({ mean: mean(parts), error }, other, `part ${k}`);
        }
      });
    }
  });
});
