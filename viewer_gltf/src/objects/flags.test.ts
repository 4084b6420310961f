import { describe, expect, it } from "vitest";
import { type ObjectView, START_OBJECTS } from "../state/objects";
import { filtered, flag } from "./flags";
import { COUNT, loadedTable } from "./sample_table";

async function flagged(view: Partial<ObjectView>, neighbours: readonly number[] = []) {
  const table = await loadedTable();
  const flags = new Uint8Array(COUNT);
  const left = flag(flags, { ...START_OBJECTS, ...view }, (id) => table.bytes(id), neighbours);
  expect(left).toBe([...flags].filter((each) => each > 0).length);
  return [...flags];
}

describe("the objects that show", () => {
  it("are all objects at the start", async () => {
    expect(await flagged({})).toEqual([1, 1, 1, 1, 1, 1]);
  });

  it("leave out hidden objects, and all but the isolated ones", async () => {
    expect(await flagged({ hidden: [1, 99] })).toEqual([1, 0, 1, 1, 1, 1]);
    expect(await flagged({ only: [1, 2, 99], hidden: [2] })).toEqual([0, 1, 0, 0, 0, 0]);
  });

  it("lie within all ranges, which leaves out objects without a value", async () => {
    expect(await flagged({ ranges: { size: [1, 255] } })).toEqual([1, 1, 1, 1, 1, 1]); // all values
    expect(await flagged({ ranges: { size: [64, 255] } })).toEqual([0, 0, 1, 1, 1, 1]);
    const both = { ranges: { size: [2, 200] as const }, without: { type: [1] } };
    expect(await flagged(both)).toEqual([0, 0, 1, 1, 0, 0]);
  });

  it("leave out excluded categories, where -1 stands for objects without a category", async () => {
    expect(await flagged({ without: { type: [0, -1] } })).toEqual([0, 1, 0, 0, 1, 0]);
  });

  it("ignore the filter of a column that is still loading", () => {
    const flags = new Uint8Array(COUNT);
    expect(flag(flags, { ...START_OBJECTS, ranges: { size: [9, 9] } }, () => null, [])).toBe(COUNT);
  });

  it("are lit if picked, selected or a neighbour of the picked one, unless they are hidden", async () => {
    const view = { selected: [0, 1], picked: 1, hidden: [0] };
    expect(await flagged(view, [2, 0])).toEqual([0, 4, 2, 1, 1, 1]);
  });
});

it("lists the columns whose filters leave something out", () => {
  const view = { ranges: { a: [1, 255], b: [1, 254] }, without: { c: [], d: [0] } } as const;
  expect(filtered({ ...START_OBJECTS, ...view })).toEqual(["b", "d"]);
});
