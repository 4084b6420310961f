import { describe, expect, it } from "vitest";
import { type Branch, branchOf, leaveOut, putBack } from "./failed_branch";

interface Tile extends Branch<Tile> {}

/** A tile below another; `holds` an external tileset, and draws nothing. */
function below(parent: Tile | null, holds: "surface" | "tileset" = "surface"): Tile {
  const tile = {
    parent,
    children: [],
    internal: { hasUnrenderableContent: holds === "tileset" },
  };
  parent?.children?.push(tile);
  return tile;
}

describe("a tile that has failed", () => {
  const coarsest = below(below(null));
  const holder = below(coarsest, "tileset");
  const first = below(holder);
  const finest = below(first);

  it("is left out alone where its parent is a surface", () => {
    expect(branchOf(finest)).toBe(finest);
    expect(branchOf(holder)).toBe(holder);
  });

  it("is left out with what holds it, so that the surface above has nothing to wait for", () => {
    expect(branchOf(first)).toBe(holder);
    leaveOut(branchOf(first));
    expect(coarsest.children).toEqual([]);
    expect(holder.children).toEqual([first]);
  });

  it("is put back once", () => {
    putBack(branchOf(first));
    putBack(branchOf(first));
    expect(coarsest.children).toEqual([holder]);
    expect(holder.children).toEqual([first]);
  });

  it("stays where it is if it is the root", () => {
    const root = below(null);
    leaveOut(root);
    putBack(root);
    expect(branchOf(root)).toBe(root);
  });
});
