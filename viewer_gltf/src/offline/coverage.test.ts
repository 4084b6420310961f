import { expect, it } from "vitest";
import { type Asked, keyOf } from "../bundle/request_log";
import { coverageOf, coverageText, type Layer } from "./coverage";

const file = (name: string): Asked => ({ url: `https://host/${name}`, range: null });
/** Three levels of two tiles, fine before coarse. */
const LAYER: Layer = ["a", "b"].map((tile) => ({
  tile,
  levels: [0, 1, 2].map((level) => [file(`${tile}/${level}`)]),
}));
const keysOf = (...names: readonly string[]) => new Set(names.map((name) => keyOf(file(name))));
const coverage = (answered: readonly string[], kept = answered) =>
  coverageOf(["a", "b"], [LAYER], answered.map(file), keysOf(...kept)).tiles;

it("the coverage counts every tile as kept if all tiles were shown and kept at the same level", () => {
  expect(coverage(["a/2", "b/2"])).toBe(2);
});

it("the coverage counts only tiles that are kept at the finest level that was shown anywhere", () => {
  expect(coverage(["a/2", "b/2", "a/1"])).toBe(1);
  expect(coverage(["a/2", "b/2", "a/1", "a/0", "b/1"])).toBe(1);
  expect(coverage(["a/2", "b/2", "a/1", "b/1"])).toBe(2);
});

it("the coverage counts no tile whose level was shown but is not kept", () => {
  expect(coverage(["a/2", "b/2"], ["a/2"])).toBe(1);
});

it("the coverage counts a level that an earlier visit has kept", () => {
  expect(coverage(["a/2", "b/2", "a/0"], ["a/2", "b/2", "a/0", "b/0"])).toBe(2);
});

it("the coverage expects the finest level of a tile that has fewer levels than others", () => {
  const short: Layer = [LAYER[0], { tile: "b", levels: LAYER[1].levels.slice(0, 1) }];
  const answered = ["a/2", "b/0"];
  expect(coverageOf(["a", "b"], [short], answered.map(file), keysOf(...answered)).tiles).toBe(1);
  const fine = ["a/0", "b/0"];
  expect(coverageOf(["a", "b"], [short], fine.map(file), keysOf(...fine)).tiles).toBe(2);
});

it("the coverage ignores a layer that was never shown", () => {
  expect(coverageOf(["a", "b"], [LAYER], [], new Set()).tiles).toBe(2);
});

it("the announcement says that every place is kept, or how much is kept and why not more", () => {
  expect(coverageText({ tiles: 10 }, 10)).toMatch(/^Ready offline: /);
  const more = "A tile is also kept once you have looked at it from near.";
  expect(coverageText({ tiles: 3 }, 10)).toBe(
    `Kept for offline: the overview and 3 of 10 tiles. ${more}`,
  );
  expect(coverageText({ tiles: 0 }, 10)).toBe(`Kept for offline: the overview. ${more}`);
  expect(coverageText({ tiles: 0, isByView: true }, 10)).toBe(
    "Kept for offline: the overview. This host sends volumes for each view, so volumes need the network.",
  );
});
