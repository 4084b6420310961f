/**
 * The path tracer against what is known: a medium that swallows nothing vanishes in a white room,
 * light fades as Beer and Lambert have it, and another path tracer, tests/support/reference_path_tracer.py,
 * gathers the same. Whatever the bricks' size, and however the samples are spread. What comes after
 * the light is in denoise_and_tone.test.ts.
 */
import { describe, expect, it } from "vitest";
import { SKIP_BRICK } from "../../src/bundle/generated/constants";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { IS_EXHAUSTIVE, sweep } from "../support/exhaustive";
import type { Gathered, Harness, Run } from "../support/pathtrace/harness";
import { BASE, opacityRamp, SIZE } from "../support/pathtrace/phantom";
import { askPython, hasPython } from "../support/python";

/** Texels of the tracer that rest or are sampled as one. */
const NOISE_TILE = 16;

/** Edges of the bricks of majorants, texels. */
const BRICKS = [SKIP_BRICK, 2 * SKIP_BRICK, 4 * SKIP_BRICK];

/** Of the reference: its standard errors are below 1 % then. */
const PATHS = 600_000;

const luminanceOf = ([r, g, b]: readonly number[]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;
const mean = (values: readonly number[]) => values.reduce((a, b) => a + b, 0) / values.length;

type Estimate = Readonly<{ mean: number; error: number }>;

/** Of the whole picture's luminance, with its standard error: by each pixel's own variance. */
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

/** Of the whole picture's coverage. */
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

  /** The same medium in other forms. */
  const TOLD = [
    ["by value and gradient", { isTwoD: true }],
    ["in bricks", { isBricked: true }],
    ["in bricks by value and gradient", { isBricked: true, isTwoD: true }],
    ["as four channels", { channels: 4 }],
    ["as two channels by value and gradient", { channels: 2, isTwoD: true }],
  ] as const satisfies readonly (readonly [string, Partial<Run>])[];

  const swallowsNothing = [
    ["scattering forward", { surface: 0, anisotropy: 0.6 }, {}],
    ["with surfaces that shine", { surface: 0.7, shine: 1 }, {}],
    ...TOLD.slice(3).map(([name, told]) => [name, { surface: 0.4 }, told] as const),
  ] as const;
  for (const [name, settings, told] of sweep(
    swallowsNothing,
    ([, { surface }, told]) => surface === 0.7 || "isTwoD" in told,
  )) {
    it(`lets a medium that swallows nothing vanish in a white room: ${name}`, async () => {
      const passes = Object.keys(told).length > 0 ? 96 : 256;
      const pixels = 20;
      const { sums } = await gather({ ...BASE, ...told, settings, passes, pixels });
      const found: number[] = [];
      for (let i = 0; i < sums.length; i += 4) {
        if (sums[i + 3] < 0.2 * passes) continue;
        const behind = passes - sums[i + 3]; // white, too
        found.push(mean(sums.slice(i, i + 3).map((v) => (v + behind) / passes)));
      }
      expect(found.length).toBeGreaterThan(80);
      expect(Math.abs(mean(found) - 1)).toBeLessThan(0.01);
    });
  }

  it("lets it vanish in a picture that moves, too: paths that are cut short meet the room", async () => {
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
      // far away: all rays go straight through, along z
      camera: { eye: [16, -16, 64_000], target: [16, -16, 16], fov_deg: 0.02 },
      settings: { isMultiple: false },
    };
    const AXIS = Array.from({ length: SIZE[2] }, (_, i) => i);
    /** Of intensities along z; the first and the last are apron. */
    const slab = (intensities: readonly number[]) =>
      intensities.flatMap((value) => new Array<number>(SIZE[0] * SIZE[1]).fill(value));

    const isAsExpected = (found: Gathered, expected: number) => {
      const { mean: met } = coverage(found);
      const count = samplesOf(found).reduce((a, b) => a + b, 0);
      const error = Math.sqrt((expected * (1 - expected)) / count);
      expect(Math.abs(1 - met - expected) / error).toBeLessThan(3);
    };

    it("that is the same all through", async () => {
      const opacity = 20;
      const opacities = new Array<number>(256).fill(opacity);
      const texels = slab(AXIS.map(() => 255));
      const expected = (1 - opacity / 255) ** 32; // 32 um of voxels of 1 um
      isAsExpected(await gather({ ...far, texels, opacities }), expected);
    });

    for (const [name, told] of sweep(TOLD, ([, told]) => !("isTwoD" in told))) {
      it(`given ${name}`, async () => {
        const { channels = 1 }: Partial<Run> = told;
        const opacity = 20; // of one channel; as 8-bit tables hold it, alike channels' shares
        const share = Math.round(255 * (1 - (1 - opacity / 255) ** (1 / channels)));
        const opacities = new Array<number>(256).fill(opacity);
        const texels = slab(AXIS.map(() => 255));
        const expected = (1 - share / 255) ** (32 * channels);
        isAsExpected(await gather({ ...far, ...told, texels, opacities }), expected);
      });
    }

    // steep, and in waves: bricks of every size have majorants of their own
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
      it(`that thickens inwards, bricks of ${brick}`, async () => {
        const texels = slab(intensities);
        const run = { ...far, texels, opacities, brick, passes: 128 };
        isAsExpected(await gather(run), Math.exp(-depth));
      });
    }
  });

  it("lights even matter at the face of a cut as a matt wall of its colour", async () => {
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

  it("covers as much whatever the bricks' size", async () => {
    const [small, ...larger] = sweep(BRICKS, (brick) => brick !== 2 * SKIP_BRICK);
    const found = coverage(await gather({ ...BASE, brick: small }));
    for (const brick of larger) {
      const other = coverage(await gather({ ...BASE, brick }));
      expectAlike(found, other, `bricks of ${small} and of ${brick}`);
    }
  });

  it("takes turns with the tiles: after a whole turn each pixel has one sample", async () => {
    const run: Run = { ...BASE, pixels: 64 };
    const half = await gather({ ...run, share: 1 / 4, passes: 2 });
    expect(new Set(samplesOf(half))).toEqual(new Set([0, 1]));
    expect(half.picture.every((v) => v === 0)).toBe(true); // nothing is shown in halves
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

  describe("spreads its samples", () => {
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

    it("by the noise of the tiles, and the mean stays", async () => {
      const even = await gather(run);
      const adaptive = await gather({ ...run, calm: 0.02 });
      expect(tiles(even).every(({ samples }) => samples === passes)).toBe(true);
      const found = tiles(adaptive);
      const empty = found.filter(({ isEmpty }) => isEmpty);
      const drawn = found.filter(({ isEmpty }) => !isEmpty);
      expect(empty.length).toBeGreaterThan(3);
      // after two looks at the noise, an eighth of the frames
      expect(mean(empty.map(({ samples }) => samples))).toBeLessThan(16 + 0.25 * (passes - 16));
      expect(Math.max(...drawn.map(({ samples }) => samples))).toBeGreaterThan(0.9 * passes);
      expect(mean(drawn.map(({ samples }) => samples))).toBeGreaterThan(
        1.5 * mean(empty.map(({ samples }) => samples)),
      );
      expectAlike(brightness(adaptive), brightness(even), "brightness");
      expectAlike(coverage(adaptive), coverage(even), "coverage");
    });
  });

  describe("carries along what it has gathered", () => {
    // a pixel shows .8 um of the middle; eyes may tremble by .53 um
    const still: Run = { ...BASE, color: [0.9, 0.7, 0.5], pixels: 48, passes: 64 };

    it("while the eye trembles: nothing is lost", async () => {
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

    it("and shows each point where the eye sees it by now, once between pixels", async () => {
      // a slanted disc in front of nothing: its colour grows with x and y, its brim is a circle
      const [pixels, fov_deg, radius] = [64, 24, 14];
      const unit = 2 * Math.tan((fov_deg * Math.PI) / 360);
      type Eye = [number, number, number];
      /** Where the disc's plane, z = x / 3, is met; and how far away. */
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

    it.runIf(IS_EXHAUSTIVE)("while it sways slowly, up to a limit", async () => {
      const sway = Array.from({ length: 64 }, (_, i) => [0.1 * Math.min(i, 63 - i), 0, 0]);
      const fresh = await gather(still);
      const swayed = await gather({ ...still, asides: sway });
      const met = (found: Gathered, share: number) =>
        Array.from({ length: still.pixels ** 2 }, (_, i) => i).filter(
          (i) => found.sums[4 * i + 3] >= share * found.moments[4 * i + 1],
        );
      const counts = met(fresh, 0.5).map((i) => swayed.moments[4 * i + 1]);
      expect(counts.length).toBeGreaterThan(100);
      expect(mean(counts)).toBeGreaterThan(16);
      // 48 of them, and its own from the last place on
      expect(Math.max(...counts)).toBeLessThan(56);
      // what is seen stays the same: neighbours share samples, which are as many in all
      const few = {
        ...fresh,
        moments: fresh.moments.map((v) => v / 2),
        sums: fresh.sums.map((v) => v / 2),
      };
      for (const estimate of [brightness, coverage]) {
        const { error } = estimate(few); // of 32 samples
        expectAlike({ mean: estimate(swayed).mean, error }, estimate(fresh), estimate.name);
      }
    });

    it("but begins anew where the eye really moves", async () => {
      const asides = [...new Array<number[]>(15).fill([0, 0, 0]), [5, 0, 0]];
      const moved = await gather({ ...still, passes: 16, asides });
      expect(new Set(samplesOf(moved))).toEqual(new Set([1]));
      expect(moved.samples).toBe(1);
    });
  });

  it("finds a pit's ground less open than a face", async () => {
    // dense up to z = 54, with a pit 3 wide and 24 deep in its middle; seen from above
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
      // 16 um of the middle
      camera: { eye: [10, -10, 6000], target: [10, -10, 20], fov_deg: 0.153 },
    });
    const openness = (isThere: (away_um: number) => boolean) => {
      let [open, met] = [0, 0];
      samplesOf(found).forEach((_, i) => {
        const [x, y] = [i % 32, Math.floor(i / 32)].map((v) => Math.abs((v - 15.5) / 2));
        if (!isThere(Math.max(x, y))) return;
        open += found.moments[4 * i + 3];
        met += found.sums[4 * i + 3];
      });
      return open / met;
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
