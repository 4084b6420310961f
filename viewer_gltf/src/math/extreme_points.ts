/** The points of a cloud that lie farthest out, in directions all round: enough to frame all of it. Pure. */
import { dot, type Vec3 } from "./vec3";

/** Directions: the nearest is within 10 degrees of any, where a ball is seen 1.5 % too small. */
const COUNT = 200;
const GOLDEN_RAD = Math.PI * (3 - Math.sqrt(5));

/** Spread evenly over the sphere, by a spiral from pole to pole. */
const WAYS = Array.from({ length: COUNT }, (_, i): Vec3 => {
  const y = 1 - (2 * i + 1) / COUNT;
  const r = Math.sqrt(1 - y * y);
  return [r * Math.cos(i * GOLDEN_RAD), y, r * Math.sin(i * GOLDEN_RAD)];
});

export function extremePoints(points: readonly Vec3[]): readonly Vec3[] {
  const found = new Set<Vec3>();
  for (const way of WAYS) {
    let [best, most] = [points[0], Number.NEGATIVE_INFINITY];
    for (const point of points) {
      const out = dot(point, way);
      if (out > most) [best, most] = [point, out];
    }
    if (best !== undefined) found.add(best);
  }
  return [...found];
}
