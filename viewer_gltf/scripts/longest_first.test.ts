import { existsSync } from "node:fs";
import { describe, expect, it } from "vitest";
import type { TestSpecification, Vitest } from "vitest/node";
import { LAST, LONG, LongestFirst } from "./longest_first";

const TESTS = new URL("../test/", import.meta.url).pathname;

describe("the order of the files of tests", () => {
  const cache = { getFileTestResults: () => undefined, getFileStats: () => undefined };
  const order = new LongestFirst({ cache, config: { root: TESTS } } as unknown as Vitest);
  const project = { name: "browser", config: { sequence: { groupOrder: 0 }, isolate: false } };
  const sort = async (names: readonly string[]) => {
    const files = names.map((name) => ({ project, moduleId: `${TESTS}${name}.test.ts` }));
    const sorted = await order.sort(files as unknown as TestSpecification[]);
    return sorted.map(({ moduleId }) => moduleId.slice(TESTS.length, -".test.ts".length));
  };

  it("begins with those that take long, and leaves the others as they were", async () => {
    const [first, second] = LONG;
    const given = ["b/b", second, LAST, "a/a", first];
    expect(await sort(given)).toEqual([first, second, "b/b", "a/a", LAST]);
  });

  it("knows no file that is none", () => {
    expect([...LONG, LAST].filter((name) => !existsSync(`${TESTS}${name}.test.ts`))).toEqual([]);
  });
});
