/** The order in which boxes that do not overlap are blended. */
import type { Vec3 } from "../math/vec3";

/**
 * Returns the sum over the axes of the distance from the eye to the box. In a grid of boxes along
 * the axes, a ray enters only boxes with a larger sum. So drawing the largest sums first is the
 * right order, also for boxes of different sizes. In contrast, three.js sorts by depth, which is
 * the same for a whole row of tiles.
 */
export function distanceInGrid(eye: Vec3, min: Vec3, max: Vec3): number {
  let sum = 0;
  for (let axis = 0; axis < 3; axis++) {
    sum += Math.max(min[axis] - eye[axis], 0, eye[axis] - max[axis]);
  }
  return sum;
}
