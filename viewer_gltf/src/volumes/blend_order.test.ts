import { describe, expect, it } from "vitest";
import { AHEAD, boxSpan } from "../math/box";
import type { Vec3 } from "../math/vec3";
import { distanceInGrid } from "./blend_order";

const EDGES = [
  [0, 4, 10, 13],
  [-7, -2, 0],
  [0, 3, 5],
];

function boxes(): { min: Vec3; max: Vec3 }[] {
  const [xs, ys, zs] = EDGES.map((edges) => edges.slice(1).map((v, i) => [edges[i], v]));
  return xs.flatMap(([x0, x1]) =>
    ys.flatMap(([y0, y1]) =>
      zs.map(([z0, z1]) => ({ min: [x0, y0, z0] as const, max: [x1, y1, z1] as const })),
    ),
  );
}

describe("the order of boxes", () => {
  it("grows along every ray, from outside the grid and from inside", () => {
    let seed = 1;
    const random = () => {
      seed = (seed * 48271) % 2147483647; // Park & Miller: the same rays in every run
      return seed / 2147483647;
    };
    for (let n = 0; n < 500; n++) {
      const origin: Vec3 = [40 * random() - 12, 30 * random() - 18, 30 * random() - 10];
      const direction: Vec3 = [13 * random(), -7 * random(), 5 * random()].map(
        (v, i) => v - origin[i],
      ) as unknown as Vec3;
      const hit = boxes()
        .map(({ min, max }) => ({
          along: boxSpan(AHEAD, { origin, direction }, { min, max })?.[0] ?? null,
          order: distanceInGrid(origin, min, max),
        }))
        .filter(({ along }) => along !== null)
        .sort((a, b) => (a.along ?? 0) - (b.along ?? 0));
      for (let i = 1; i < hit.length; i++) expect(hit[i].order).toBeGreaterThan(hit[i - 1].order);
    }
  });
});
