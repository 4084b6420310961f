/** The polygon in which a plane cuts a box, which is the visible part of a clip plane. */
import { Vector3 } from "three";
import type { Box } from "./box";
import type { ClipPlane } from "./clip";
import type { Vec3 } from "./vec3";

/** Largest number of corners of a plane's section through a box. */
export const MAX_CORNERS = 6;
/** Least distance of two corners, as a share of the box's diagonal; closer ones are merged. */
const SAME = 1e-9;

/** Corners in order around the plane's normal; fewer than three if the plane misses the box. */
export function planeSection({ normal, offset_um }: ClipPlane, { min, max }: Box): readonly Vec3[] {
  const n = new Vector3(...normal);
  const corners = Array.from(
    { length: 8 },
    (_, i) =>
      new Vector3(i & 1 ? max[0] : min[0], i & 2 ? max[1] : min[1], i & 4 ? max[2] : min[2]),
  );
  const heights = corners.map((corner) => n.dot(corner) - offset_um);
  const same = SAME * corners[0].distanceTo(corners[7]);
  const points: Vector3[] = [];
  for (let a = 0; a < 8; a++) {
    for (const bit of [1, 2, 4]) {
      const b = a | bit;
      if (a === b || heights[a] > 0 === heights[b] > 0) continue;
      const point = corners[a].clone().lerp(corners[b], heights[a] / (heights[a] - heights[b]));
      if (points.every((other) => other.distanceTo(point) > same)) points.push(point);
    }
  }
  if (points.length < 3) return [];
  const middle = new Vector3();
  for (const point of points) middle.addScaledVector(point, 1 / points.length);
  const u = points[0].clone().sub(middle).normalize();
  const v = n.clone().cross(u);
  const angle = (p: Vector3) => {
    const from = p.clone().sub(middle);
    return Math.atan2(from.dot(v), from.dot(u));
  };
  return points.sort((a, b) => angle(a) - angle(b)).map((p) => p.toArray());
}
