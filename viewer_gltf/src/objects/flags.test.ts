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

describe("which objects show", () => {
  it("are all at the start", async () => {
    expect(await flagged({})).toEqual([1, 1, 1, 1, 1, 1]);
  });

  it("are not those that are hidden, or others than the only ones", async () => {
    expect(await flagged({ hidden: [1, 99] })).toEqual([1, 0, 1, 1, 1, 1]);
    expect(await flagged({ only: [1, 2, 99], hidden: [2] })).toEqual([0, 1, 0, 0, 0, 0]);
  });

  it("are within all ranges, and what has no value is in none", async () => {
    expect(await flagged({ ranges: { size: [1, 255] } })).toEqual([1, 1, 1, 1, 1, 1]); // whole
    expect(await flagged({ ranges: { size: [64, 255] } })).toEqual([0, 0, 1, 1, 1, 1]);
    const both = { ranges: { size: [2, 200] as const }, without: { type: [1] } };
    expect(await flagged(both)).toEqual([0, 0, 1, 1, 0, 0]);
  });

  it("are of the categories that are left, -1 is none", async () => {
    expect(await flagged({ without: { type: [0, -1] } })).toEqual([0, 1, 0, 0, 1, 0]);
  });

  it("wait for no column that has not come", () => {
    const flags = new Uint8Array(COUNT);
    expect(flag(flags, { ...START_OBJECTS, ranges: { size: [9, 9] } }, () => null, [])).toBe(COUNT);
  });

  it("are lit as picked, selected, or next to it, unless they are gone", async () => {
    const view = { selected: [0, 1], picked: 1, hidden: [0] };
    expect(await flagged(view, [2, 0])).toEqual([0, 4, 2, 1, 1, 1]);
  });
});

it("filters are columns of which a part is left out", () => {
  const view = { ranges: { a: [1, 255], b: [1, 254] }, without: { c: [], d: [0] } } as const;
  expect(filtered({ ...START_OBJECTS, ...view })).toEqual(["b", "d"]);
});
