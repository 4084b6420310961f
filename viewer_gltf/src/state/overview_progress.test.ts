import { describe, expect, it } from "vitest";
import { overview } from "./overview_progress";

describe("the overview's progress", () => {
  it("counts the tiles of all tilesets", () => {
    expect(
      overview([
        { total: 10, done: 4 },
        { total: 2, done: 2 },
      ]),
    ).toEqual({
      done: 6,
      total: 12,
      isComplete: false,
    });
  });

  it("is not complete before a tileset has arrived", () => {
    expect(overview([{ total: null, done: 0 }]).isComplete).toBe(false);
  });

  it("is complete if there is nothing to load", () => {
    expect(overview([]).isComplete).toBe(true);
    expect(overview([{ total: 0, done: 0 }]).isComplete).toBe(true);
  });
});
