/**
 * The gap between objects. Each is drawn smaller towards the middle of its box, so that it keeps its form: moved
 * along its normals a surface folds over wherever it is narrower than the gap. Its narrowest side is shorter by
 * the gap, half of it at either end; two neighbours leave as much between them. One that is so bent that its box's
 * middle lies outside of it may be drawn across its own wall.
 */
import { along, type Ray, type Vec3 } from "../math/vec3";

/** Least share of an object's size that a gap leaves, as in chunks/object_gap.glsl. */
const MIN_LEFT = 0.2;

/** The middle of a row's box, and its narrowest side, um. */
export function middleOf(boxes: Float32Array, row: number): [number, number, number, number] {
  const [x, y, z, ...high] = boxes.subarray(6 * row, 6 * row + 6);
  const narrowest = Math.min(high[0] - x, high[1] - y, high[2] - z);
  return [(x + high[0]) / 2, (y + high[1]) / 2, (z + high[2]) / 2, narrowest];
}

/** The ray that meets the object at its own size where the given one, as far along, meets it as it is drawn. */
export function grownFrom(ray: Ray, boxes: Float32Array, row: number, gap_um: number): Ray {
  const [x, y, z, narrowest] = middleOf(boxes, row);
  const growth = 1 / Math.max(MIN_LEFT, 1 - gap_um / narrowest);
  const middle: Vec3 = [x, y, z];
  const [dx, dy, dz] = ray.direction;
  const off = ray.origin.map((v, i) => v - middle[i]) as unknown as Vec3;
  return {
    origin: along(middle, off, growth),
    direction: [growth * dx, growth * dy, growth * dz],
  };
}
