import { describe, expect, it } from "vitest";
import { ENTRIES } from "../voxels/transfer_luts";
import { alikeRows } from "../voxels/transfer_table_2d";
import { tracedTable, tracedTable2d } from "./traced_table";

/** Opacity and red of each entry equal its number. */
const ramp = Uint8Array.from({ length: 4 * ENTRIES }, (_, i) =>
  i % 4 === 0 || i % 4 === 3 ? Math.floor(i / 4) : 255,
);
const opacityOf = (table: Uint8Array, i: number) => table[4 * i + 3];

describe("the table of path tracing and its stand-in", () => {
  it("is the transfer function's own table without settings", () => {
    expect(tracedTable(ramp, { bias: 0, threshold: 0 })).toBe(ramp);
  });

  it("gives each grey value the entry of another one, shifted by the transmission", () => {
    const brighter = tracedTable(ramp, { bias: 40 / 255, threshold: 0 });
    expect([0, 100, 230].map((i) => opacityOf(brighter, i))).toEqual([40, 140, 255]);
    const darker = tracedTable(ramp, { bias: -25 / 255, threshold: 0 });
    expect([0, 100, 230].map((i) => [darker[4 * i], opacityOf(darker, i)])).toEqual([
      [0, 0],
      [75, 75],
      [205, 205],
    ]);
  });

  it("is empty below the threshold, and unchanged above it", () => {
    const table = tracedTable(ramp, { bias: 0.5, threshold: 0.4 });
    const shifted = tracedTable(ramp, { bias: 0.5, threshold: 0 });
    expect([0, 50, 101].map((i) => opacityOf(table, i))).toEqual([0, 0, 0]);
    expect([102, 180, 255].map((i) => opacityOf(table, i))).toEqual(
      [102, 180, 255].map((i) => opacityOf(shifted, i)),
    );
  });

  it("is computed once for a table of value and gradient, in all rows", () => {
    const table2d = { cells: alikeRows(ramp), gradientMax: 0.5, envelope: ramp };
    const shift = { bias: 0.1, threshold: 0.3 };
    const made = tracedTable2d(table2d, shift);
    expect(made.cells).toEqual(alikeRows(tracedTable(ramp, shift)));
    expect(tracedTable2d(table2d, { ...shift })).toBe(made);
    expect(tracedTable2d(table2d, { ...shift, bias: 0.2 })).not.toBe(made);
  });
});
