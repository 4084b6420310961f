import { describe, expect, it } from "vitest";
import type { ColumnRange, ObjectColumn } from "../bundle/generated/objects";
import { type ObjectView, START_OBJECTS } from "../state/objects";
import { readLinked, writeLinked } from "./linked";
import { byteValue } from "./palettes";
import { sampleTable } from "./sample_table";

const TABLE = sampleTable();
const write = (view: ObjectView, table = TABLE) => writeLinked(view, table).text;
const read = (text: string): ObjectView => ({ ...START_OBJECTS, ...readLinked(text, TABLE) });

describe("objects in a link", () => {
  it("are read back as they were written", () => {
    const view: ObjectView = {
      ...START_OBJECTS,
      colorBy: "size",
      palette: "magma",
      span: [10, 200],
      isLog: false,
      ranges: { size: [5, 255] },
      without: { type: [0, -1] },
      hidden: [1],
      only: [1, 2, 3],
      selected: [2],
      picked: 3,
      isStained: false,
      gap_um: 0.5,
      scatter: ["size", "size"],
    };
    expect(read(write(view))).toEqual(view);
  });

  it("are found by number, value and name, because another build has other rows and bytes", () => {
    const view: ObjectView = {
      ...START_OBJECTS,
      ranges: { size: [64, 255] },
      without: { type: [1] },
      selected: [0, 1, 2, 5],
      picked: 4,
    };
    const [column, types] = TABLE.columns;
    const others = [{ ...column, range: { ...column.range, low: 0.5, high: 900 } }, types].map(
      (each) => ({ ...each, categories: each.categories && ["new", ...each.categories] }),
    ) as ObjectColumn[];
    const found = readLinked(write(view), {
      ...{ count: 7, first: "type" },
      column: (id) => others.find((each) => each.id === id) ?? null,
      label: (row) => String(106 - row),
    });
    expect(found.selected).toEqual([1, 4, 5, 6]); // rows of the objects 105, 102, 101 and 100
    expect(found.picked).toBe(2);
    expect(found.without).toEqual({ type: [2] });
    const [low, high] = found.ranges?.size ?? [];
    expect(high).toBe(255); // an open end stays open
    const value = (range: ColumnRange | undefined, byte = 0) => range && byteValue(range, byte);
    expect(Math.log(value(others[0].range, low) ?? 0)).toBeCloseTo(
      Math.log(value(column.range, 64) ?? 0),
      1,
    );
  });

  it("are short if their numbers are consecutive, and left out if their list is too long", () => {
    const count = 100_000;
    const table = {
      ...{ count, first: "", column: () => null },
      label: (row: number) => String(2n ** 53n + BigInt(row)),
    };
    const many = { ...START_OBJECTS, selected: Array.from({ length: count }, (_, row) => row) };
    const { text, leftOut } = writeLinked(many, table);
    expect([text.length < 60, leftOut]).toEqual([true, 0]);
    expect(readLinked(text, table).selected).toEqual(many.selected);
    const odd = { ...many, selected: many.selected.filter((row) => row % 2 === 1) };
    expect(writeLinked(odd, table)).toEqual({ text: "", leftOut: count / 2 });
  });

  it("add no text to a link while the view is the opening one, even during a search", () => {
    expect(write({ ...START_OBJECTS, search: "liver", lasso: [[0, 0]] })).toBe("");
  });

  it("are ignored if this table does not have them", () => {
    const texts = [
      ...["", "{", "null", "3", "[]", '"x"'],
      JSON.stringify({
        colorBy: "no such",
        palette: "x",
        span: [9, 1],
        isLog: 3,
        ranges: { a: [1, 2], size: [1] },
      }),
      JSON.stringify({
        without: { type: ["no such"], size: 1 },
        hidden: "0-99.106-340282366920938463463.-1.1-.x",
        only: 5,
        picked: "99",
      }),
      JSON.stringify({
        gap_um: 1e9,
        scatter: ["size", "none"],
        selected: { length: 3 },
        ranges: null,
      }),
      JSON.stringify({ gap_um: -1, isStained: 1, span: [9, 1], scatter: 1, without: [1] }),
      JSON.stringify({ hidden: [100], selected: [0], picked: 100, ranges: { size: ["1", 2] } }),
    ];
    for (const text of texts) {
      const view = read(text);
      expect({ ...view, only: null }, text).toEqual(START_OBJECTS);
    }
  });
});
