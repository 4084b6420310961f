import { describe, expect, it } from "vitest";
import type { Manifest } from "../bundle/generated/bundle";
import { distanceToBox, pickTile } from "./pick";

const TILES: Manifest["tiles"] = [
  { id: "left", representation: "mesh", bounds_um: { min: [0, -10, 0], max: [10, 0, 5] } },
  { id: "right", representation: "mesh", bounds_um: { min: [10, -10, 0], max: [20, 0, 5] } },
];

describe("the tile that is looked at", () => {
  it("is the first along the ray", () => {
    expect(pickTile({ origin: [15, -5, 100], direction: [0, 0, -1] }, TILES)).toBe("right");
    expect(pickTile({ origin: [-100, -5, 2], direction: [1, 0, 0] }, TILES)).toBe("left");
    expect(pickTile({ origin: [100, -5, 2], direction: [-1, 0, 0] }, TILES)).toBe("right");
  });

  it("is none if the ray misses or looks away", () => {
    expect(pickTile({ origin: [15, 5, 100], direction: [0, 0, -1] }, TILES)).toBeNull();
    expect(pickTile({ origin: [15, -5, 100], direction: [0, 0, 1] }, TILES)).toBeNull();
  });

  it("lies at the distance of its near face, or 0 inside", () => {
    const { min, max } = TILES[0].bounds_um;
    expect(distanceToBox({ origin: [5, -5, 105], direction: [0, 0, -2] }, min, max)).toBe(50);
    expect(distanceToBox({ origin: [5, -5, 2], direction: [0, 0, -2] }, min, max)).toBe(0);
  });
});
