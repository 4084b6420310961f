import { describe, expect, it } from "vitest";
import { type Branch, branchOf, leaveOut, putBack } from "./failed_branch";

interface Tile extends Branch<Tile> {}

/**
 * A tile below another one; with `holds` "tileset", it contains an external tileset and draws
 * nothing.
 */
function below(parent: Tile | null, holds: "surface" | "tileset" = "surface"): Tile {
  const tile = {
    parent,
    children: [],
    internal: { hasUnrenderableContent: holds === "tileset" },
  };
  parent?.children?.push(tile);
  return tile;
}

describe("a failed tile", () => {
  const coarsest = below(below(null));
  const holder = below(coarsest, "tileset");
  const first = below(holder);
  const finest = below(first);

  it("is removed alone if its parent is a surface", () => {
    expect(branchOf(finest)).toBe(finest);
    expect(branchOf(holder)).toBe(holder);
  });

  it("is removed together with its holder, so that the surface above does not wait for it", () => {
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
