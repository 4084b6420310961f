import { describe, expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import type { Size3 } from "../bundle/ktx2";
import { brickDistances, FAR, markVisible, occupancyDistances, opacityRanges } from "./empty_space";

/** By definition: the largest of the three differences to the nearest visible brick. */
function distancesByDefinition(visible: Uint8Array, [nx, ny, nz]: Size3): Uint8Array {
  const at = (i: number) => [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))] as const;
  const seeds = [...visible.keys()].filter((i) => visible[i] !== 0).map(at);
  return Uint8Array.from({ length: nx * ny * nz }, (_, i) => {
    const [x, y, z] = at(i);
    let nearest = FAR;
    for (const [a, b, c] of seeds) {
      nearest = Math.min(nearest, Math.max(Math.abs(x - a), Math.abs(y - b), Math.abs(z - c)));
    }
    return nearest;
  });
}

describe("empty space", () => {
  it("consists of bricks in which no intensity between the extremes is visible", () => {
    const alpha = new Uint8Array(256);
    alpha[100] = 7; // a single visible intensity
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

  it("has the distance FAR everywhere if nothing is visible", () => {
    expect([...brickDistances(new Uint8Array(8), [2, 2, 2])]).toEqual(Array(8).fill(FAR));
  });

  it("has the distance by definition in random volumes of any shape", () => {
    const random = seeded(5);
    for (let run = 0; run < 120; run++) {
      const edge = () => 1 + Math.floor(random() ** 2 * 14);
      const size: Size3 = [edge(), edge(), edge()];
      const share = random() ** 4;
      const visible = new Uint8Array(size[0] * size[1] * size[2]);
      for (let i = 0; i < visible.length; i++) visible[i] = random() < share ? 1 : 0;
      expect(brickDistances(visible, size)).toEqual(distancesByDefinition(visible, size));
    }
  });

  it("ends at the largest byte in a longer row", () => {
    const visible = new Uint8Array(600);
    visible[0] = 1;
    const distance = brickDistances(visible, [600, 1, 1]);
    expect([distance[254], distance[255], distance[256], distance[599]]).toEqual([
      254,
      255,
      FAR,
      FAR,
    ]);
  });

  it("is empty under all channels combined", () => {
    const clear = new Uint8Array(256);
    const alpha = clear.slice();
    alpha[9] = 255;
    const low = Uint8Array.of(0, 0, 0, 0, 0, 0);
    const high = Uint8Array.of(0, 0, 0, 0, 5, 10);
    const of = (alphas: Uint8Array[]) =>
      occupancyDistances({ bricks: [low, high], alphas, count: [3, 1, 1] });
    expect([...of([alpha, alpha])]).toEqual([2, 1, 0]);
    expect([...of([alpha, clear])]).toEqual([FAR, FAR, FAR]);
  });

  it("rejects arrays that don't fit each other", () => {
    const alpha = new Uint8Array(256);
    const bricks = [new Uint8Array(6)];
    const wrong = { bricks, alphas: [alpha], count: [4, 1, 1] } as const;
    expect(() => occupancyDistances(wrong)).toThrow("expected 8 bytes");
    expect(() => occupancyDistances({ bricks, alphas: [], count: [3, 1, 1] })).toThrow(RangeError);
  });
});
