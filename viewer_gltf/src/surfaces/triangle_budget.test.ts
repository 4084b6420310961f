import { describe, expect, it } from "vitest";
import { memoryBudget } from "../gpu/memory_budget";
import { coarserFor, FINEST, type Levels, trianglesAt } from "./triangle_budget";

/** Errors and triangles of a tile of 5000 cells, seen from near. */
const TILE: Levels = [
  { error_px: 12, triangles: 470_000 },
  { error_px: 7, triangles: 500_000 },
  { error_px: 4, triangles: 690_000 },
  { error_px: 0, triangles: 1_500_000 },
];
/** The same tile with the eye inside it. */
const ROUND_THE_EYE: Levels = TILE.map(({ error_px, triangles }) => ({
  error_px: error_px && Number.POSITIVE_INFINITY,
  triangles,
}));
const PHONE = memoryBudget({ userAgent: "Android" }).triangles;
const COMPUTER = memoryBudget({ userAgent: "X11; Linux", deviceMemory: 8 }).triangles;
const FOUR = [TILE, TILE, TILE, TILE];

describe("surfaces within a device's triangle budget", () => {
  it("are as fine as requested if that is within the budget", () => {
    expect(trianglesAt([TILE, TILE], 5)).toBe(1_380_000);
    expect(trianglesAt([TILE], 2)).toBe(1_500_000);
    expect(coarserFor(FOUR, 2, COMPUTER, FINEST)).toBe(FINEST);
    expect(coarserFor([TILE], 2, PHONE, FINEST)).toBe(FINEST);
    expect(coarserFor([], 2, PHONE, FINEST)).toBe(FINEST);
  });

  it("are coarser at once if they exceed the budget, but no coarser than needed", () => {
    const two = [TILE, TILE];
    const coarser = coarserFor(two, 2, PHONE, FINEST);
    expect(trianglesAt(two, 2, coarser)).toBe(1_380_000);
    expect(coarser).toEqual({ factor: 2, leftOut: 0 });
    // if even the coarsest levels exceed the budget, they are drawn
    expect(trianglesAt(FOUR, 2, coarserFor(FOUR, 2, PHONE, FINEST))).toBe(1_880_000);
  });

  it("stay within the budget even around the eye, where no error is small enough", () => {
    const tiles = [ROUND_THE_EYE, ROUND_THE_EYE];
    expect(trianglesAt(tiles, 4)).toBe(3_000_000);
    expect(trianglesAt(tiles, 2, coarserFor(tiles, 2, PHONE, FINEST))).toBe(1_380_000);
  });

  it("do not alternate between levels near the budget", () => {
    const two = [TILE, TILE];
    const most = trianglesAt(two, 2);
    const coarser = coarserFor(two, 2, most - 1, FINEST);
    expect(coarser).not.toBe(FINEST);
    expect(coarserFor(two, 2, most + 1, coarser)).toBe(coarser);
    expect(coarserFor(two, 2, 2 * most, coarser)).toBe(FINEST);
  });
});
