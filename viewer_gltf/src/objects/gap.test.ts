import { expect, it } from "vitest";
import { grownFrom, middleOf } from "./gap";

const BOXES = Float32Array.of(9, 9, 9, 9, 9, 9, 0, 10, 20, 4, 16, 30);

it("returns the centre and the shortest edge of an object's box", () => {
  expect(middleOf(BOXES, 1)).toEqual([2, 13, 25, 4]);
});

it("returns a ray that hits the original object where the given ray hits the shrunk one", () => {
  const ray = { origin: [7, 1, 2], direction: [-1, 2, 3] } as const;
  for (const [gap_um, left] of [
    [0, 1],
    [1, 0.75], // the box's shortest edge is shorter by the gap
    [2, 0.5],
    [99, 0.2],
  ]) {
    const { origin, direction } = grownFrom(ray, BOXES, 1, gap_um);
    for (const t of [0, 1, 4]) {
      for (const [i, middle] of [2, 13, 25].entries()) {
        const place = origin[i] + t * direction[i];
        const drawn = ray.origin[i] + t * ray.direction[i];
        expect(middle + left * (place - middle)).toBeCloseTo(drawn, 9);
      }
    }
  }
});
