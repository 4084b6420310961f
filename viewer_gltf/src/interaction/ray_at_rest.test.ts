import { expect, it } from "vitest";
import type { Ray } from "../math/vec3";
import { advanceRest, type Rest } from "./ray_at_rest";

const DEGREE = Math.PI / 180;
const rayAt = (angle_deg: number, x = 0): Ray => ({
  origin: [x, 0, 0],
  direction: [Math.sin(angle_deg * DEGREE), 0, -Math.cos(angle_deg * DEGREE)],
});

function play(rays: readonly Ray[]): number {
  let rest: Rest | null = null;
  for (const ray of rays) rest = advanceRest(rest, ray, 3, 0.1);
  return rest?.elapsed_s ?? 0;
}

it("a rest continues while the ray only trembles", () => {
  const rays = Array.from({ length: 11 }, (_, i) => rayAt(i % 2, i % 3));
  expect(play(rays)).toBeCloseTo(1);
});

it("a rest starts again if the ray turns or its origin moves", () => {
  expect(play([rayAt(0), rayAt(0), rayAt(5), rayAt(5)])).toBeCloseTo(0.1);
  expect(play([rayAt(0), rayAt(0), rayAt(0, 4), rayAt(0, 4)])).toBeCloseTo(0.1);
});

it("a rest does not continue during a slow drift", () => {
  const rays = Array.from({ length: 50 }, (_, i) => rayAt(0.25 * i));
  expect(play(rays)).toBeLessThan(0.6);
});
