/** Points and directions as plain numbers: x, y, z. */

export type Vec3 = readonly [number, number, number];
export type Ray = Readonly<{ origin: Vec3; direction: Vec3 }>;

export const AXES = [0, 1, 2] as const;

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** The point `by` lengths of the direction away from `p`. */
export function along(p: Vec3, direction: Vec3, by: number): Vec3 {
  return [p[0] + by * direction[0], p[1] + by * direction[1], p[2] + by * direction[2]];
}

/** The vector with one component replaced. */
export function withPart(p: Vec3, axis: (typeof AXES)[number], value: number): Vec3 {
  return [axis === 0 ? value : p[0], axis === 1 ? value : p[1], axis === 2 ? value : p[2]];
}
