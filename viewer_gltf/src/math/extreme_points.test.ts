import { describe, expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import { extremePoints } from "./extreme_points";
import { dot, type Vec3 } from "./vec3";

describe("the extreme points of a cloud", () => {
  it("reach as far as the whole cloud, in any direction", () => {
    const some = seeded(3);
    const unit = (): Vec3 => {
      const y = 2 * some() - 1;
      const turn = 2 * Math.PI * some();
      const r = Math.sqrt(1 - y * y);
      return [r * Math.cos(turn), y, r * Math.sin(turn)];
    };
    const ball = Array.from({ length: 20_000 }, unit);
    const found = extremePoints(ball);
    expect(found.length).toBeLessThanOrEqual(200);
    for (let i = 0; i < 500; i++) {
      const way = unit();
      expect(Math.max(...found.map((point) => dot(point, way)))).toBeGreaterThan(0.98);
    }
  });

  it("are the corners of a box, without inner points", () => {
    const grid = [-1, -0.5, 0, 0.5, 1];
    const filled = grid.flatMap((x) => grid.flatMap((y) => grid.map((z): Vec3 => [x, y, z])));
    const found = extremePoints(filled);
    expect(found).toHaveLength(8);
    for (const point of found) for (const part of point) expect(Math.abs(part)).toBe(1);
  });

  it("are empty for an empty cloud", () => {
    expect(extremePoints([])).toEqual([]);
  });
});
