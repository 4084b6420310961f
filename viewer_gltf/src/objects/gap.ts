/**
 * The gap between objects. Each object is shrunk towards the centre of its bounding box until the box's shortest
 * edge is shorter by the gap, half of it at each end. Two neighbours of similar size are then one gap apart.
 * Shrinking keeps the object's shape. Moving the surface along its normals would fold it over wherever the object
 * is narrower than the gap. An object that is bent around the centre of its box, such as a horseshoe, may be drawn
 * across its own original surface.
 */
import { along, type Ray, type Vec3 } from "../math/vec3";

/** Smallest share of an object's size that is left by a wide gap. chunks/object_gap.glsl has the same limit. */
const MIN_LEFT = 0.2;

/** Returns the centre (x, y, z) of the box of a row's object, and the box's shortest edge, in um. */
export function middleOf(boxes: Float32Array, row: number): [number, number, number, number] {
  const [x, y, z, ...high] = boxes.subarray(6 * row, 6 * row + 6);
  const narrowest = Math.min(high[0] - x, high[1] - y, high[2] - z);
  return [(x + high[0]) / 2, (y + high[1]) / 2, (z + high[2]) / 2, narrowest];
}

/**
 * Returns a ray through the object at its original size. It hits that object at the same ray parameter at which
 * the given ray hits the shrunk object that is drawn.
 */
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
