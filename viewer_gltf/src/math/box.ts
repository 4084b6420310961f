/** Axis-aligned boxes, and the part of a ray that lies inside one. */
import { AXES, type Ray, type Vec3 } from "./vec3";

export type Box = Readonly<{ min: Vec3; max: Vec3 }>;
/** Part of a ray, in multiples of its direction's length; entry before exit. */
export type Span = readonly [number, number];
/** Span of a whole ray, from its origin to infinity. */
export const AHEAD: Span = [0, Number.POSITIVE_INFINITY];

export function centerOf({ min, max }: Box): Vec3 {
  return [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2];
}

export function cornersOf({ min, max }: Box): readonly Vec3[] {
  const at = (corner: number, axis: 0 | 1 | 2) => ((corner >> axis) & 1 ? max : min)[axis];
  return Array.from({ length: 8 }, (_, i) => [at(i, 0), at(i, 1), at(i, 2)]);
}

export function around(points: readonly Vec3[]): Box {
  const all = AXES.map((axis) => points.map((point) => point[axis]));
  const [x0, y0, z0] = all.map((values) => Math.min(...values));
  const [x1, y1, z1] = all.map((values) => Math.max(...values));
  return { min: [x0, y0, z0], max: [x1, y1, z1] };
}

/**
 * Returns the part of a ray's span inside a box, or null. In a flat box, entry and exit are the
 * same. Every frame calls this thousands of times, so it allocates only its result.
 */
export function boxSpan(span: Span, { origin, direction }: Ray, { min, max }: Box): Span | null {
  let from = span[0];
  let to = span[1];
  for (let axis = 0; axis < 3; axis++) {
    const o = origin[axis];
    const d = direction[axis];
    if (d === 0) {
      if (o < min[axis] || o > max[axis]) return null;
      continue;
    }
    const a = (min[axis] - o) / d;
    const b = (max[axis] - o) / d;
    from = Math.max(from, Math.min(a, b));
    to = Math.min(to, Math.max(a, b));
    if (from > to) return null;
  }
  return [from, to];
}
