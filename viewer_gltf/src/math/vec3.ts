/** Places and directions as plain numbers: x, y, z. Pure. */

export type Vec3 = readonly [number, number, number];
export type Ray = Readonly<{ origin: Vec3; direction: Vec3 }>;

export const AXES = [0, 1, 2] as const;

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** The place so many lengths of the direction further. */
export function along(p: Vec3, direction: Vec3, by: number): Vec3 {
  return [p[0] + by * direction[0], p[1] + by * direction[1], p[2] + by * direction[2]];
}

/** The same but for its part along one axis. */
export function withPart(p: Vec3, axis: (typeof AXES)[number], value: number): Vec3 {
  return [axis === 0 ? value : p[0], axis === 1 ? value : p[1], axis === 2 ? value : p[2]];
}
