import { describe, expect, it } from "vitest";
import { type BuildState, readBuildState, wordsOf } from "./build_state";

const SENT = {
  doing: "building",
  label: "units",
  done: 3,
  total: 20,
  tiles: 1,
  all_tiles: 10,
  share: 0.41,
  left_s: 38.5,
  folder: "g1/",
  has_bundle: false,
  line: "",
  place: 0,
  may_control: true,
  may_continue: true,
};
const read = (changes: Partial<Record<keyof typeof SENT, unknown>> = {}) =>
  readBuildState(JSON.stringify({ ...SENT, ...changes })) as BuildState;

describe("a message of the server", () => {
  it("is read by its names", () => {
    expect(read()).toEqual({
      ...{ doing: "building", label: "units", done: 3, total: 20, tiles: 1, allTiles: 10 },
      ...{ share: 0.41, left_s: 38.5, folder: "g1/", hasBundle: false, line: "", place: 0 },
      ...{ mayControl: true, mayContinue: true },
    });
  });

  it("is ignored if it has another form", () => {
    for (const text of ["", "null", "[]", "7", '{"doing": "sleeping"}', "{"]) {
      expect(readBuildState(text), text).toBeNull();
    }
  });

  it("can't name a folder outside the page's own", () => {
    for (const folder of ["../", "https://elsewhere/", "g1", "g1/../", "//g1/", 7]) {
      expect(read({ folder }).folder).toBe("");
    }
    expect(read({ share: 7 }).share).toBe(1);
    expect(read({ left_s: null }).left_s).toBeNull();
  });
});

describe("the words for a build", () => {
  it.each([
    [{}, "Building surfaces: 1 of 10 tiles, about 40 s left"],
    [{ all_tiles: 1, tiles: 0, left_s: null }, "Building surfaces: 0 of 1 tile"],
    [{ label: "", total: 0, left_s: null }, "Planning the build"],
    [{ label: "stage", left_s: 400 }, "Writing the stage: 3 of 20, about 7 min left"],
    [{ label: "report", done: 0, total: 1, left_s: 2 }, "Writing the report, about 5 s left"],
    [{ left_s: 9000 }, "Building surfaces: 1 of 10 tiles, about 3 h left"],
    [{ doing: "pausing" }, "Pausing after the running tasks."],
    [{ doing: "paused" }, "Paused: 1 of 10 tiles."],
    [{ doing: "cancelled" }, "The build was cancelled. Finished parts are kept."],
    [
      { doing: "failed", line: "a.tif: cut off" },
      "The build has stopped: a.tif: cut off. The view stays as it is.",
    ],
    [{ doing: "failed" }, "The build has stopped. The view stays as it is."],
    [{ doing: "complete" }, "Complete: all surfaces are built."],
    [{ doing: "unbuilt" }, ""],
    [{ doing: "queued", place: 3 }, "Waiting for other builds."],
    [{ doing: "queued", place: 1 }, "Waiting for its build to begin."],
  ])("%o are %s", (changes, words) => {
    expect(wordsOf(read(changes), true)).toBe(words);
  });

  it("calls a build complete once the page shows it", () => {
    expect(wordsOf(read({ doing: "complete" }), false)).toBe("Built. Opening the surfaces.");
  });
});
