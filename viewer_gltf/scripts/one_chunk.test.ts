import { expect, it } from "vitest";
import { oneChunk, reachOf } from "./one_chunk";

const IMPORTS: Readonly<Record<string, readonly string[]>> = {
  page: ["main"],
  main: ["shared", "ring"],
  ring: ["main"],
  shared: [],
  part: ["shared", "own"], // fetched later
  own: [],
};
const modules = {
  getModuleInfo: (id: string) => (id in IMPORTS ? { importedIds: IMPORTS[id] } : null),
};

it("puts all modules that the page imports, also in a circle, into one file", () => {
  expect([...reachOf("page", modules)].sort()).toEqual(["main", "page", "ring", "shared"]);
});

it("leaves parts that load later to the bundler", () => {
  const nameOf = oneChunk("page", "index");
  expect(nameOf("shared", modules)).toBe("index");
  expect(["part", "own"].map((id) => nameOf(id, modules))).toEqual([null, null]);
});
