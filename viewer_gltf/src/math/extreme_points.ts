/**
 * The outermost points of a cloud, in evenly spread directions: enough to frame the whole cloud.
 */
import { dot, type Vec3 } from "./vec3";

/**
 * Number of directions. Any direction has one within 10 degrees, so a ball is framed at most 1.5 %
 * too small.
 */
const COUNT = 200;
const GOLDEN_RAD = Math.PI * (3 - Math.sqrt(5));

/** Unit vectors spread evenly over the sphere, on a spiral from pole to pole. */
const DIRECTIONS = Array.from({ length: COUNT }, (_, i): Vec3 => {
  const y = 1 - (2 * i + 1) / COUNT;
  const r = Math.sqrt(1 - y * y);
  return [r * Math.cos(i * GOLDEN_RAD), y, r * Math.sin(i * GOLDEN_RAD)];
});

export function extremePoints(points: readonly Vec3[]): readonly Vec3[] {
  const found = new Set<Vec3>();
  for (const way of DIRECTIONS) {
    let [best, most] = [points[0], Number.NEGATIVE_INFINITY];
    for (const point of points) {
      const out = dot(point, way);
      if (out > most) [best, most] = [point, out];
    }
    if (best !== undefined) found.add(best);
  }
  return [...found];
}
