import { describe, expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import { reduced } from "./environment_file";
import { asBrightAs, environmentTables } from "./environment_sampling";

const luminance = (rgb: ArrayLike<number>, i: number) =>
  0.2126 * rgb[3 * i] + 0.7152 * rgb[3 * i + 1] + 0.0722 * rgb[3 * i + 2];

function room(width: number, height: number, power: number) {
  const random = seeded(width);
  const rgb = Float32Array.from({ length: 3 * width * height }, () => random() ** power);
  return { width, height, rgb };
}

/** Returns the solid angle of each texel; they add up to 4 pi. */
function solidAngles(width: number, height: number): number[] {
  return Array.from({ length: width * height }, (_, i) => {
    const at = (row: number) => Math.cos((Math.PI * row) / height);
    const row = Math.floor(i / width);
    return ((at(row) - at(row + 1)) * 2 * Math.PI) / width;
  });
}

describe("light from all around", () => {
  for (const [width, height, power] of [
    [16, 8, 1],
    [7, 5, 12],
    [1, 1, 1],
    [64, 32, 30],
  ]) {
    it(`is sampled in proportion to its radiance: ${width} x ${height}, power ${power}`, () => {
      const given = room(width, height, power);
      const { aliases, light } = environmentTables(given);
      const count = width * height;
      const angles = solidAngles(width, height);
      const weights = angles.map((angle, i) => luminance(given.rgb, i) * angle);
      const sum = weights.reduce((a, b) => a + b);
      // Each entry is drawn with the same probability. It gives its own texel, or its alias.
      const drawn = new Float64Array(count);
      for (let i = 0; i < count; i++) {
        const [keep, other] = [aliases[2 * i], aliases[2 * i + 1]];
        expect(keep).toBeGreaterThanOrEqual(0);
        expect(keep).toBeLessThanOrEqual(1);
        expect(Number.isInteger(other) && other >= 0 && other < count).toBe(true);
        drawn[i] += keep / count;
        drawn[other] += (1 - keep) / count;
      }
      let density = 0;
      drawn.forEach((share, i) => {
        expect(share).toBeCloseTo(weights[i] / sum, 5);
        expect(light[4 * i + 3] * angles[i]).toBeCloseTo(weights[i] / sum, 5);
        density += light[4 * i + 3] * angles[i];
        expect([...light.slice(4 * i, 4 * i + 3)]).toEqual([...given.rgb.slice(3 * i, 3 * i + 3)]);
      });
      expect(density).toBeCloseTo(1, 5);
    });
  }

  it("is dark if the map is dark, and treats invalid values as dark", () => {
    const half = environmentTables({
      width: 2,
      height: 4,
      rgb: Float32Array.from({ length: 24 }, (_, i) => (i < 12 ? [2, 1, 0.5][i % 3] : 0)),
    });
    half.mean.forEach((v, k) => {
      expect(v).toBeCloseTo([1, 0.5, 0.25][k], 6); // mean of a bright upper half and a dark lower half
    });
    const dark = environmentTables({ width: 2, height: 2, rgb: new Float32Array(12) });
    expect([...dark.light].every((v) => v === 0)).toBe(true);
    const rgb = Float32Array.from([1, 1, 1, Number.NaN, -3, Number.POSITIVE_INFINITY]);
    const { light } = environmentTables({ width: 2, height: 1, rgb });
    expect([...light.slice(4)]).toEqual([0, 0, 0, 0]);
    expect(light[3]).toBeCloseTo(1 / (2 * Math.PI), 5); // only half of the sphere is sampled
  });

  it("can be scaled to the brightness of another environment", () => {
    const rgb = Float32Array.from({ length: 24 }, (_, i) => 4000 * (1 + (i % 7)));
    const tables = environmentTables({ width: 2, height: 4, rgb });
    const { light, mean } = asBrightAs(tables, 1);
    expect(0.2126 * mean[0] + 0.7152 * mean[1] + 0.0722 * mean[2]).toBeCloseTo(1, 6);
    const factor = light[0] / rgb[0];
    [1, 2, 4, 5].forEach((i) => {
      expect(light[i] / tables.light[i]).toBeCloseTo(factor, 6);
    });
    expect(light[3]).toBe(tables.light[3]); // the probability density is unchanged
    const dark = environmentTables({ width: 1, height: 1, rgb: new Float32Array(3) });
    expect(asBrightAs(dark, 1)).toBe(dark);
  });

  it("is refused if it has too few values", () => {
    const rgb = new Float32Array(9);
    expect(() => environmentTables({ width: 2, height: 2, rgb })).toThrow(/expected 12 .* found 9/);
    expect(() => environmentTables({ width: 0, height: 0, rgb: new Float32Array(0) })).toThrow();
  });
});

describe("the user's environment map", () => {
  it("keeps its size if it is small, without its alpha", () => {
    const data = Float32Array.from([1, 2, 3, 9, 4, 5, 6, 9]);
    expect(reduced(data, 2, 1, 4, false)).toEqual({
      width: 2,
      height: 1,
      rgb: Float32Array.from([1, 2, 3, 4, 5, 6]),
    });
  });

  it("is flipped if its bottom row comes first", () => {
    const data = Float32Array.from([1, 1, 1, 2, 2, 2]);
    expect([...reduced(data, 1, 2, 3, true).rgb]).toEqual([2, 2, 2, 1, 1, 1]);
  });

  it("is averaged down to few columns, also at edges that blocks do not fill", () => {
    const [width, height] = [1027, 4]; // blocks of three by three texels, with one column left over
    const random = seeded(3);
    const data = Float32Array.from({ length: 3 * width * height }, () => random());
    const small = reduced(data, width, height, 3, false);
    expect([small.width, small.height]).toEqual([343, 2]);
    const meanOf = (column: number, row: number, k: number) => {
      const found: number[] = [];
      for (let y = 3 * row; y < Math.min(height, 3 * row + 3); y++) {
        for (let x = 3 * column; x < Math.min(width, 3 * column + 3); x++) {
          found.push(data[3 * (y * width + x) + k]);
        }
      }
      return found.reduce((a, b) => a + b) / found.length;
    };
    for (const [column, row] of [
      [0, 0],
      [17, 1],
      [342, 0],
      [342, 1],
    ]) {
      for (const k of [0, 1, 2]) {
        const at = 3 * (row * small.width + column) + k;
        expect(small.rgb[at]).toBeCloseTo(meanOf(column, row, k), 5);
      }
    }
  });
});
