import { describe, expect, it } from "vitest";
import { brickDistances, FAR, markVisible, opacityRanges } from "./occupancy";

describe("empty space", () => {
  it("is what no intensity between a brick's extremes makes visible", () => {
    const alpha = new Uint8Array(256);
    alpha[100] = 7; // one single visible intensity
    const visible = new Uint8Array(4);
    markVisible(visible, Uint8Array.of(0, 99, 101, 255, 90, 110, 100, 100), opacityRanges(alpha));
    expect([...visible]).toEqual([0, 0, 1, 1]);
  });

  it("has the Chebyshev distance to the nearest visible brick", () => {
    const size = [7, 5, 4] as const;
    const visible = new Uint8Array(7 * 5 * 4);
    const seeds = [
      [1, 1, 0],
      [6, 4, 3],
    ];
    for (const [x, y, z] of seeds) visible[(z * 5 + y) * 7 + x] = 1;
    const distance = brickDistances(visible, size);
    for (let z = 0; z < 4; z++)
      for (let y = 0; y < 5; y++)
        for (let x = 0; x < 7; x++) {
          const expected = Math.min(
            ...seeds.map(([a, b, c]) =>
              Math.max(Math.abs(x - a), Math.abs(y - b), Math.abs(z - c)),
            ),
          );
          expect(distance[(z * 5 + y) * 7 + x]).toBe(expected);
        }
  });

  it("is far everywhere if nothing is visible", () => {
    expect([...brickDistances(new Uint8Array(8), [2, 2, 2])]).toEqual(Array(8).fill(FAR));
  });
});
