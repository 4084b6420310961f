import { expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import type { Box } from "./box";
import { planeSection } from "./plane_box_section";
import type { Vec3 } from "./vec3";

const CUBE: Box = { min: [0, 0, 0], max: [2, 2, 2] };
const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const dot = (a: Vec3, b: Vec3) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function area(corners: readonly Vec3[], normal: Vec3): number {
  let sum = 0;
  for (let i = 2; i < corners.length; i++) {
    sum += dot(normal, cross(sub(corners[i - 1], corners[0]), sub(corners[i], corners[0]))) / 2;
  }
  return sum;
}

it("the section of a cube by a plane is a square, a triangle or a regular hexagon", () => {
  expect(area(planeSection({ normal: [0, 0, 1], offset_um: 0.5 }, CUBE), [0, 0, 1])).toBeCloseTo(4);
  const n = 1 / Math.sqrt(3);
  const normal: Vec3 = [n, n, n];
  const triangle = planeSection({ normal, offset_um: n }, CUBE);
  expect(triangle).toHaveLength(3);
  expect(area(triangle, normal)).toBeCloseTo(Math.sqrt(3) / 2);
  const hexagon = planeSection({ normal, offset_um: 3 * n }, CUBE);
  expect(hexagon).toHaveLength(6);
  expect(area(hexagon, normal)).toBeCloseTo(3 * Math.sqrt(3)); // edges of length sqrt(2)
});

it("the section is empty if the plane misses the box", () => {
  expect(planeSection({ normal: [1, 0, 0], offset_um: 2.1 }, CUBE)).toEqual([]);
  expect(planeSection({ normal: [1, 0, 0], offset_um: -0.1 }, CUBE)).toEqual([]);
});

it("the section is convex, with corners on the plane and in the box, in order, for any plane", () => {
  const random = seeded(5);
  const box: Box = { min: [-3, 0, 5], max: [7, 1, 9] };
  for (let run = 0; run < 300; run++) {
    const raw: Vec3 = [random() - 0.5, random() - 0.5, random() - 0.5];
    const length = Math.hypot(...raw);
    const normal: Vec3 = [raw[0] / length, raw[1] / length, raw[2] / length];
    const offset_um = dot(normal, [-3 + 10 * random(), random(), 5 + 4 * random()]);
    const corners = planeSection({ normal, offset_um }, box);
    corners.forEach((corner, i) => {
      expect(dot(normal, corner)).toBeCloseTo(offset_um, 9);
      corner.forEach((v, axis) => {
        expect(v).toBeGreaterThan(box.min[axis] - 1e-9);
        expect(v).toBeLessThan(box.max[axis] + 1e-9);
      });
      const next = corners[(i + 1) % corners.length];
      const after = corners[(i + 2) % corners.length];
      const turn = dot(normal, cross(sub(next, corner), sub(after, next)));
      expect(turn).toBeGreaterThan(-1e-9);
    });
  }
});
