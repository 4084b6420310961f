import { describe, expect, it } from "vitest";
import type { Manifest } from "../bundle/generated/bundle";
import { additionSections } from "./section";

const MANIFEST = {
  additions: {
    layers: [
      { id: "/Specimen/Arrow", name: "Here" },
      { id: "/Specimen/Wire", name: "Wire" },
    ],
  },
} as unknown as Manifest;

describe("the section of additions", () => {
  it("has a named switch for each addition, in the stage's order", () => {
    const [{ items }] = additionSections(MANIFEST, { hiddenAdditions: ["/Specimen/Wire"] });
    const found = items.map((item) => item.kind === "toggle" && [item.label, item.value]);
    expect(found).toEqual([
      ["Here", true],
      ["Wire", false],
    ]);
  });

  it("hides or shows one addition, and keeps the other hidden ones hidden", () => {
    const hiding = (hiddenAdditions: readonly string[], shown: boolean) => {
      const [{ items }] = additionSections(MANIFEST, { hiddenAdditions });
      const [first] = items;
      return first.kind === "toggle" && first.to(shown);
    };
    const [arrow, wire] = ["/Specimen/Arrow", "/Specimen/Wire"];
    expect(hiding([wire], false)).toEqual({ type: "hide-additions", hidden: [wire, arrow] });
    expect(hiding([arrow, wire], true)).toEqual({ type: "hide-additions", hidden: [wire] });
  });

  it("does not exist if the stage has no additions", () => {
    expect(additionSections({} as Manifest, { hiddenAdditions: [] })).toEqual([]);
  });
});
