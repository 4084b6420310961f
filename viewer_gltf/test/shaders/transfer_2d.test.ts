/** Tests of the ray march and path tracing with two-dimensional transfer functions. */
import { expect, it } from "vitest";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { seeded } from "../support/seeded";
import { readChunks, runProgram, type Texture } from "../support/shaders/chunk";
import type { Harness2d } from "../support/shaders/harness2d";

describeInChromium("two-dimensional transfer functions", () => {
  const bare = prepareBarePage<Harness2d>(
    new URL("../support/shaders/harness2d.ts", import.meta.url),
  );

  // The slope rises from 0 at voxel 20 to 1 at voxel 28 of 48. Two voxels on it differ by a
  // quarter, which is half of the steepest gradient, 0.5; at its ends the gradient is half of that.
  const SLOPE_AT = [20, 28] as const;
  const OPACITY = 3 / 255;
  const through = 1 - (1 - OPACITY) ** 48;
  /** Opacities of the columns whose middle lies between two places. */
  const between = (columns: readonly number[], from: number, to: number) =>
    columns.filter((_, i) => {
      const x = (48 * (i + 0.5)) / columns.length;
      return x > from && x < to;
    });

  it("show a boundary by its gradient, and nothing of uniform matter", async () => {
    const columns = await bare.call("showSlope", [0, 1], [0.4, 0.6], OPACITY);
    const [from, to] = SLOPE_AT;
    const onSlope = between(columns, from + 1.2, to - 1.2);
    expect(onSlope.length).toBeGreaterThan(5);
    for (const found of onSlope) expect(Math.abs(found - through)).toBeLessThan(0.02);
    const flat = [...between(columns, 0, from - 0.8), ...between(columns, to + 0.8, 48)];
    expect(flat.length).toBeGreaterThan(45);
    expect(Math.max(...flat)).toBe(0);
  });

  it("show uniform matter, and nothing of its boundary, even at the same values", async () => {
    const columns = await bare.call("showSlope", [0.1, 1], [0, 0.2], OPACITY);
    const [from, to] = SLOPE_AT;
    for (const found of between(columns, to + 1, 47)) {
      expect(Math.abs(found - through)).toBeLessThan(0.02);
    }
    // values 0.15 to 0.85 lie in the shape's range, but their gradients do not
    expect(Math.max(...between(columns, 0, to - 1.2))).toBe(0);
    expect(between(columns, from + 1.2, to - 1.2).length).toBeGreaterThan(5);
  });

  it("give the image of a one-dimensional function if they do not depend on the gradient", async () => {
    let drawn = 0;
    for (let seed = 0; seed < 6; seed++) {
      const found = await bare.call("compareAlike", seed);
      expect(found.apart, `seed ${seed}`).toBeLessThanOrEqual(1);
      drawn += found.drawn;
    }
    expect(drawn).toBeGreaterThan(500);
  });

  it("show the same with and without skips", async () => {
    let drawn = 0;
    for (let seed = 0; seed < 8; seed++) {
      const found = await bare.call("compareSkips2d", seed);
      expect(found.apart, `seed ${seed}`).toBeLessThanOrEqual(1);
      drawn += found.drawn;
    }
    expect(drawn).toBeGreaterThan(500);
  });

  it("measure the step over two voxels for each channel separately", async () => {
    const chunks = await readChunks("transfer_table_2d");
    // intensities that rise by this much per unit of the texture, along each axis
    const slopes = [
      [1, 0, 0],
      [0, -2, 0],
      [0.5, 0.5, 1],
      [9, 9, 9],
    ];
    const voxel = [0.1, 0.05, 0.2];
    const steepest = [0.4, 0.5, 0.8, 1];
    const vec = (v: readonly number[]) =>
      `vec${v.length}(${v.map((n) => n.toFixed(4)).join(", ")})`;
    const head = `vec4 sampleIntensities(vec3 p) {
        return vec4(${slopes.map((slope) => `dot(p, ${vec(slope)})`).join(", ")});
      }
      #include <chunks/transfer_table_2d>`;
    const found = await runProgram(
      bare.page,
      chunks,
      head,
      `oColor = steepnessOf(stepsAt(vec3(0.3, 0.4, 0.5), ${vec(voxel)}));`,
      { uGradientMax: steepest },
    );
    steepest.forEach((most, c) => {
      const step = Math.hypot(...slopes[c].map((slope, axis) => 2 * voxel[axis] * slope));
      expect(found[c]).toBeCloseTo(Math.min(1, step / most), 5);
    });
  });

  it("interpolate a path's medium between the cells of each channel's rows", async () => {
    const chunks = await readChunks("medium_2d");
    const random = seeded(11);
    const texels = Array.from({ length: 256 * 128 * 4 }, () => Math.floor(256 * random()));
    const uMedium: Texture = { size: [256, 128], channels: 4, texels };
    const head = "#define CHANNELS 2\nuniform sampler2D uMedium;\n#include <chunks/medium_2d>";
    const entryOf = (c: number, value: number, gradient: number) => {
      const [x, y] = [255 * value, 63 * gradient];
      const [left, low] = [Math.min(254, Math.floor(x)), Math.min(62, Math.floor(y))];
      return [0, 1, 2, 3].map((k) => {
        const at = (i: number, j: number) => texels[4 * ((64 * c + j) * 256 + i) + k] / 255;
        const row = (j: number) => at(left, j) + (at(left + 1, j) - at(left, j)) * (x - left);
        return row(low) + (row(low + 1) - row(low)) * (y - low);
      });
    };
    const [values, gradients] = [
      [0.3, 1],
      [0.999, 0],
    ];
    const at = (v: readonly number[]) => `vec4(${v.map((n) => n.toFixed(6)).join(", ")}, 0.0, 0.0)`;
    const body = `oColor = mediumOf2d(${at(values)}, ${at(gradients)});`;
    const found = await runProgram(bare.page, chunks, head, body, { uMedium });
    const entries = [0, 1].map((c) => entryOf(c, values[c], gradients[c]));
    const sum = entries[0][3] + entries[1][3];
    for (let k = 0; k < 3; k++) {
      const expected = (entries[0][k] * entries[0][3] + entries[1][k] * entries[1][3]) / sum;
      expect(found[k]).toBeCloseTo(expected, 4);
    }
    expect(found[3]).toBeCloseTo(sum, 4);
  });
});
// The march's own lookup, "classify_2d", is part of the images above.
