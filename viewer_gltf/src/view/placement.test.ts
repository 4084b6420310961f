import { describe, expect, it } from "vitest";
import { framingDistance, LONGEST_EDGE_M, place } from "./placement";

describe("the specimen's place", () => {
  it("has its longest edge as long as the room wants it", () => {
    const { scale, center, size } = place({ min: [0, -100, 0], max: [200, 0, 50] });
    expect(200 * scale).toBeCloseTo(LONGEST_EDGE_M);
    expect(center).toEqual([100, -50, 25]);
    expect(size[2]).toBeCloseTo(LONGEST_EDGE_M / 4);
  });

  it("is framed by its wider side", () => {
    const fov = Math.PI / 2; // half the height at distance 1 is 1
    const front = (size: [number, number, number], aspect: number) =>
      framingDistance(size, fov, aspect) - size[2] / 2;
    expect(front([1, 2, 0], 1) * 0.88).toBeCloseTo(1);
    expect(front([4, 2, 0], 1) * 0.88).toBeCloseTo(2);
    expect(front([4, 2, 0], 2) * 0.88).toBeCloseTo(1);
    expect(front([2, 2, 3], 1) * 0.88).toBeCloseTo(1);
  });
});
