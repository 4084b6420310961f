import { existsSync } from "node:fs";
import { expect, it } from "vitest";
import type { TestSpecification, Vitest } from "vitest/node";
import { LAST, OneLast } from "./one_last";

const TESTS = new URL("../test/", import.meta.url).pathname;

it("keeps the order of the test files, except for the last one, which exists", async () => {
  const cache = { getFileTestResults: () => undefined, getFileStats: () => undefined };
  const order = new OneLast({ cache, config: { root: TESTS } } as unknown as Vitest);
  const project = { name: "browser", config: { sequence: { groupOrder: 0 }, isolate: false } };
  const files = ["b/b", LAST, "a/a"].map((name) => ({
    project,
    moduleId: `${TESTS}${name}.test.ts`,
  }));
  const sorted = await order.sort(files as unknown as TestSpecification[]);
  const names = sorted.map(({ moduleId }) => moduleId.slice(TESTS.length, -".test.ts".length));
  expect(names).toEqual(["b/b", "a/a", LAST]);
  expect(existsSync(`${TESTS}${LAST}.test.ts`)).toBe(true);
});
