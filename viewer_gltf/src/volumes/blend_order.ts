/** In which order boxes that don't overlap are blended. Pure. */
import type { Vec3 } from "../math/vec3";

/**
 * The sum over the axes of the distance from the eye to the box. In a grid of boxes along the axes
 * a ray leaves a box only for one that has more of it, so far boxes first is the right order, also
 * where boxes differ in size. (three sorts by depth, which is the same for a whole row of tiles.)
 */
export function distanceInGrid(eye: Vec3, min: Vec3, max: Vec3): number {
  let sum = 0;
  for (let axis = 0; axis < 3; axis++) {
    sum += Math.max(min[axis] - eye[axis], 0, eye[axis] - max[axis]);
  }
  return sum;
}
