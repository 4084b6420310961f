import { describe, expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import { randomShapes, sampled } from "../../test/support/transfer_2d";
import { COLUMNS, ROWS, type Shape } from "../bundle/transfer_2d";
import { makeShape } from "../state/transfer_shapes";
import { opacityRanges } from "./empty_space";
import { opacities } from "./transfer_luts";
import { alikeRows, envelopeOf, transferTable2d } from "./transfer_table_2d";

describe("the table of value and gradient", () => {
  it("never shows more than its envelope, so rays may skip by the envelope", () => {
    const random = seeded(3);
    for (let run = 0; run < 40; run++) {
      const window = [0.4 * random(), 0.6 + 0.4 * random()] as const;
      const table2d = transferTable2d(
        randomShapes(random),
        { gradient_max: 0.5, functions: {} },
        window,
        random(),
      );
      const table = { alpha: opacityRanges(opacities(table2d.envelope)) };
      const low = Math.floor(256 * random());
      const high = low + Math.floor((256 - low) * random());
      for (let i = 0; i < 40; i++) {
        const value = (low + (high - low) * random()) / 255;
        const gradient = random();
        expect(sampled(table2d.cells, value, gradient, 3)).toBeLessThanOrEqual(
          table.alpha[256 * low + high] + 1e-9,
        );
      }
    }
  });

  it("is read further out for a narrower window, by value and by gradient", () => {
    const shape = { ...makeShape("rectangle", { value: 0.5, gradient: 0.5 }), softness: 0 };
    const whole = transferTable2d([shape], { gradient_max: 0.8, functions: {} }, [0, 1], 1);
    const narrow = transferTable2d(
      [shape],
      { gradient_max: 0.8, functions: {} },
      [0.25, 0.75],
      0.5,
    );
    expect(narrow.gradientMax).toBeCloseTo(0.4, 12);
    for (const value of [0.1, 0.3, 0.44, 0.46, 0.5, 0.56, 0.7, 0.9]) {
      const within = Math.min(1, Math.max(0, (value - 0.25) / 0.5));
      const expected = 0.5 * sampled(whole.cells, within, 0.5, 3);
      expect(Math.abs(sampled(narrow.cells, value, 0.5, 3) - expected), `${value}`).toBeLessThan(1);
    }
  });

  it("is the same at every gradient for a one-dimensional function", () => {
    const random = seeded(5);
    const entries = Uint8Array.from({ length: 4 * COLUMNS }, () => Math.floor(256 * random()));
    const cells = alikeRows(entries);
    expect(cells).toHaveLength(4 * COLUMNS * ROWS);
    for (const gradient of [0, 0.3, 1]) {
      for (const value of [0, 0.5, 1]) {
        const k = value * (COLUMNS - 1);
        const [left, share] = [Math.min(COLUMNS - 2, Math.floor(k)), k % 1];
        const [a, b] = [entries[4 * left + 3], entries[4 * left + 7]];
        const expected = value === 1 ? entries[4 * COLUMNS - 1] : a + (b - a) * share;
        expect(sampled(cells, value, gradient, 3)).toBeCloseTo(expected, 9);
      }
    }
    expect(envelopeOf(cells)).toEqual(entries);
  });

  it("gives the cells beside a hard edge the shape's colour", () => {
    const shape: Shape = {
      ...makeShape("rectangle", { value: 0.5, gradient: 0.5 }),
      color: [1, 0, 0],
      softness: 0,
      opacity: 1,
    };
    const { cells } = transferTable2d([shape], { gradient_max: 0.5, functions: {} }, [0, 1], 1);
    let edges = 0;
    for (let at = 4; at < cells.length - 4; at += 4) {
      const hasNeighbour = cells[at + 7] > 0 || cells[at - 1] > 0;
      if (cells[at + 3] > 0 || !hasNeighbour) continue;
      edges++;
      expect([...cells.subarray(at, at + 4)]).toEqual([255, 0, 0, 0]);
    }
    expect(edges).toBeGreaterThan(20);
  });
});
