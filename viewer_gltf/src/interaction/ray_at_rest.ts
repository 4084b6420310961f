/** How long a ray has stayed in place, apart from the tremble of a hand or a head. */
import { Vector3 } from "three";
import type { Ray } from "../math/vec3";

/** Radians. Largest turn of a ray at rest. */
const TREMBLE_RAD = (1.2 * Math.PI) / 180;

export type Rest = Readonly<{ ray: Ray; elapsed_s: number }>;

/**
 * Returns the next state. The ray is compared with where the rest began, so that a slow drift
 * counts as a move.
 *
 * @param tremble_um distance that the ray's origin may move
 */
export function advanceRest(rest: Rest | null, ray: Ray, tremble_um: number, dt_s: number): Rest {
  if (rest === null) return { ray, elapsed_s: 0 };
  const { origin, direction } = rest.ray;
  const moved = new Vector3(...origin).distanceTo(new Vector3(...ray.origin));
  const turned = new Vector3(...direction).angleTo(new Vector3(...ray.direction));
  if (moved > tremble_um || turned > TREMBLE_RAD) return { ray, elapsed_s: 0 };
  return { ray: rest.ray, elapsed_s: rest.elapsed_s + dt_s };
}
