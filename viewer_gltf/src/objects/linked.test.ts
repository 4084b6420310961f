import { describe, expect, it } from "vitest";
import { linkedObjects, type ObjectView, START_OBJECTS } from "../state/objects";
import { readLinked } from "./linked";
import { sampleTable } from "./sample_table";

const TABLE = sampleTable();
const read = (text: string): ObjectView => ({ ...START_OBJECTS, ...readLinked(text, TABLE) });

describe("objects in a link", () => {
  it("come back as they went", () => {
    const view: ObjectView = {
      ...START_OBJECTS,
      colorBy: "size",
      palette: "magma",
      span: [10, 200],
      isLog: false,
      ranges: { size: [5, 250] },
      without: { type: [0, -1] },
      hidden: [1],
      only: [1, 2, 3],
      selected: [2],
      picked: 3,
      isStained: false,
      gap_um: 0.5,
      scatter: ["size", "size"],
    };
    expect(read(linkedObjects(view))).toEqual(view);
  });

  it("are nothing as they open, whatever is looked for", () => {
    expect(linkedObjects({ ...START_OBJECTS, search: "liver", lasso: [[0, 0]] })).toBe("");
  });

  it("are never more than this table has, whatever the link says", () => {
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
        without: { type: [300], size: 1 },
        hidden: [6, -1, 0.5, "1"],
        only: 5,
        picked: 99,
      }),
      JSON.stringify({
        gap_um: 1e9,
        scatter: ["size", "none"],
        selected: { length: 3 },
        ranges: null,
      }),
      JSON.stringify({ gap_um: -1, isStained: 1, span: [0, 999], scatter: 1, without: [1] }),
    ];
    for (const text of texts) {
      const view = read(text);
      expect({ ...view, only: null }, text).toEqual(START_OBJECTS);
    }
  });
});
