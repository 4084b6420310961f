import { describe, expect, it } from "vitest";
import { distanceToSee, framingDistance, LONGEST_EDGE_M, place } from "./placement";

describe("the specimen's placement", () => {
  it("makes its longest edge as long as the scene needs", () => {
    const { scale, center, size } = place({ min: [0, -100, 0], max: [200, 0, 50] });
    expect(200 * scale).toBeCloseTo(LONGEST_EDGE_M);
    expect(center).toEqual([100, -50, 25]);
    expect(size[2]).toBeCloseTo(LONGEST_EDGE_M / 4);
  });

  it("is framed by its wider side", () => {
    const fov = Math.PI / 2; // half the height is 1 at distance 1
    const front = (size: [number, number, number], aspect: number) =>
      framingDistance(size, fov, aspect) - size[2] / 2;
    expect(front([1, 2, 0], 1) * 0.88).toBeCloseTo(1);
    expect(front([4, 2, 0], 1) * 0.88).toBeCloseTo(2);
    expect(front([4, 2, 0], 2) * 0.88).toBeCloseTo(1);
    expect(front([2, 2, 3], 1) * 0.88).toBeCloseTo(1);
  });
});

describe("the distance at which points are seen", () => {
  const fov = Math.PI / 2; // half the height is 1 at distance 1

  it("is set by the point that lies nearest to the edge of the image", () => {
    // The nearness to the middle limits this; the edge alone would give 3.4.
    expect(distanceToSee([[0, 3, 0]], fov, 1)).toBeCloseTo(3.75);
    expect(distanceToSee([[0, 3, 1]], fov, 1)).toBeCloseTo(1 + 3 / 0.88);
    // The width alone would give 2.7.
    expect(distanceToSee([[-3, 0, 1]], fov, 2)).toBeCloseTo(1.25 * Math.sqrt(10));
    expect(distanceToSee([[-3, 0, 1]], fov, 0.5)).toBeCloseTo(1 + 6 / 0.88);
    const both = distanceToSee(
      [
        [0, 1, 0],
        [0, -3, 1],
      ],
      fov,
      1,
    );
    expect(both).toBeCloseTo(1 + 3 / 0.88);
  });

  it("keeps a point on the line to the eye in front of the eye", () => {
    expect(distanceToSee([[0, 0, 2]], fov, 1)).toBeCloseTo(2.5);
  });

  it("is 0 without points", () => {
    expect(distanceToSee([], fov, 1)).toBe(0);
  });
});
