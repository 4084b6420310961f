/** Which tile a ray meets first. Pure. */
import type { Manifest } from "../bundle/generated/bundle";

export type Vec3 = readonly [number, number, number];
export type Ray = Readonly<{ origin: Vec3; direction: Vec3 }>;

/** Distance along the ray (in lengths of its direction) to the box; 0 inside; null if it misses. */
export function distanceToBox(ray: Ray, min: Vec3, max: Vec3): number | null {
  let near = 0;
  let far = Number.POSITIVE_INFINITY;
  for (let axis = 0; axis < 3; axis++) {
    const o = ray.origin[axis];
    const d = ray.direction[axis];
    if (d === 0) {
      if (o < min[axis] || o > max[axis]) return null;
      continue;
    }
    const a = (min[axis] - o) / d;
    const b = (max[axis] - o) / d;
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far ? near : null;
}

/** The id of the first tile along the ray (um, world), or null. */
export function pickTile(
  ray: Ray,
  tiles: readonly Pick<Manifest["tiles"][number], "id" | "bounds_um">[],
): string | null {
  let nearest = Number.POSITIVE_INFINITY;
  let picked: string | null = null;
  for (const { id, bounds_um } of tiles) {
    const distance = distanceToBox(ray, bounds_um.min, bounds_um.max);
    if (distance === null || distance >= nearest) continue;
    nearest = distance;
    picked = id;
  }
  return picked;
}
