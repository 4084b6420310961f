import { describe, expect, it } from "vitest";
import { chooseColors } from "./choose_colors";
import { blockFor, makeCoarse, placesAlong, resample } from "./coarse_volume";
import { findWindow, histogramOf, kindOf, percentile } from "./find_window";
import { minMaxBricks, mipLevels } from "./volume_files";

const sorted = (values: readonly number[]) => Float32Array.from(values).sort();

describe("a window", () => {
  it("leaves out a share of the voxels at both ends, linear between values", () => {
    const values = sorted(Array.from({ length: 201 }, (_, i) => i));
    expect(percentile(values, 50)).toBe(100);
    expect(percentile(values, 0.25)).toBeCloseTo(0.5, 6);
    expect(findWindow(values, [0.5, 99.5])).toEqual([1, 199]);
  });

  it("holds all values of a sparse channel, and is 1 wide for a constant one", () => {
    expect(findWindow(sorted([...new Array(9999).fill(3), 90]), [0.5, 99])).toEqual([3, 90]);
    expect(findWindow(sorted([7, 7, 7]), [0.5, 99.95])).toEqual([7, 8]);
  });

  it("counts values outside it in the first and the last bin", () => {
    const counts = histogramOf(Float32Array.from([-5, 0, 255, 256, 999]), [0, 256]);
    expect([counts[0], counts[255]]).toEqual([2, 3]);
  });

  it("depends on the kind of volume", () => {
    const ct = sorted([...new Array(50).fill(-1000), ...new Array(50).fill(40)]);
    const one = { isSigned: true, channels: [0] };
    const body = [
      [1000, 1000, 1000],
      [200, 200, 200],
    ] as const;
    expect(kindOf(ct, ...body, one)).toEqual({ modality: "CT", window: [-1024, 2000] });
    expect(kindOf(ct, ...body, { ...one, isSigned: false }).modality).toBe("MR");
    expect(kindOf(sorted([0, 900]), ...body, one)).toEqual({ modality: "MR", window: [1, 99.8] });
    expect(kindOf(sorted([0, 900]), [2, 2, 2], [9, 9, 9], one).window).toEqual([1, 99.9]);
    expect(kindOf(sorted([0, 900]), [0.5, 0.2, 0.2], [9, 9, 9], one).window).toEqual([0.5, 99.95]);
  });
});

describe("colours", () => {
  it("are as stated, and no two nearly the same", () => {
    const red = [1, 0, 0] as const;
    const [first, second, third] = chooseColors([red, [0.99, 0.01, 0], null], "", 0.5);
    expect(first).toEqual(red);
    expect(second).not.toEqual(red);
    expect(new Set([first, second, third].map(String)).size).toBe(3);
  });

  it("replace a stated black, which can't be seen", () => {
    expect(Math.max(...chooseColors([[0, 0, 0]], "", 0.5)[0])).toBeGreaterThan(0.1);
  });
});

describe("a coarse volume", () => {
  const stored = {
    data: Float32Array.from({ length: 64 }, (_, i) => i),
    shape: [4, 4, 4] as const,
    ...{ offset: 0, strides: [16, 4, 1] as const, slope: 1, intercept: 0 },
  };
  const whole = { first: [0, 0, 0], step: [1, 1, 1] } as const;

  it("has the means of blocks, at their middles", () => {
    const { voxels, shape, first, step } = makeCoarse(stored, [2, 2, 2], whole, "x");
    expect([shape, first, step]).toEqual([
      [2, 2, 2],
      [0.5, 0.5, 0.5],
      [2, 2, 2],
    ]);
    expect(voxels[0]).toBe((0 + 1 + 4 + 5 + 16 + 17 + 20 + 21) / 8);
  });

  it("has blocks of about equal edges, and no more than asked for", () => {
    expect(blockFor([100, 1000, 1000], [5, 1, 1], 1e6)).toEqual(
      [1, 5, 5].map((n) => expect.closeTo(n, -1)),
    );
    const [z, y, x] = blockFor([100, 1000, 1000], [5, 1, 1], 1e6);
    expect(Math.floor(100 / z) * Math.floor(1000 / y) * Math.floor(1000 / x)).toBeLessThanOrEqual(
      1e6,
    );
    expect(blockFor([10, 10, 10], [1, 1, 1], 1e6)).toEqual([1, 1, 1]);
  });

  it("replaces values that are not numbers by the smallest value", () => {
    const data = Float32Array.from([Number.NaN, 5, Number.POSITIVE_INFINITY, 7, 9, 9, 9, 9]);
    const { voxels } = makeCoarse(
      { ...stored, data, shape: [2, 2, 2], strides: [4, 2, 1] },
      [1, 1, 1],
      whole,
      "x",
    );
    expect([...voxels]).toEqual([5, 5, 5, 7, 9, 9, 9, 9]);
    const none = { ...stored, data: new Float32Array(64).fill(Number.NaN) };
    expect(() => makeCoarse(none, [1, 1, 1], whole, "x")).toThrow("all voxels are NaN");
  });

  it("is resampled onto the box of the finest level, with an apron", () => {
    const coarse = makeCoarse(stored, [2, 2, 2], whole, "x");
    const places = placesAlong(4, 2, 1);
    expect(places).toEqual({ first: -1.5, apart: 1.5, count: 5 }); // -1.5, 0, 1.5, 3, 4.5
    const made = resample(coarse, [places, places, places]);
    expect(made.length).toBe(125);
    // Place 1.5 lies half-way between the centres 0.5 and 2.5 along each axis.
    const mean = coarse.voxels.reduce((sum, v) => sum + v, 0) / 8;
    expect(made[2 * 25 + 2 * 5 + 2]).toBeCloseTo(mean, 4);
    expect(made[0]).toBe(coarse.voxels[0]);
  });
});

describe("the files of a volume", () => {
  it("have mip levels of means, also of odd sizes", () => {
    const data = Uint8Array.from([0, 50, 100, 150, 200, 250, 0]); // 7 texels along x
    const levels = mipLevels({ size: [7, 1, 1], data });
    expect(levels.map(({ size }) => size)).toEqual([
      [7, 1, 1],
      [3, 1, 1],
    ]);
    const total = (values: Uint8Array) => values.reduce((sum, v) => sum + v, 0) / values.length;
    expect(Math.abs(total(levels[1].data) - total(data))).toBeLessThan(1);
  });

  it("have the range of each brick, including one texel more on each side", () => {
    const data = new Uint8Array(20);
    data[8] = 200; // first of the second brick
    const { size, data: ranges } = minMaxBricks({ size: [20, 1, 1], data });
    expect(size).toEqual([3, 1, 1]);
    expect([...ranges]).toEqual([0, 200, 0, 200, 0, 0]);
  });
});
