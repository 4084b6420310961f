/**
 * Handles for the lamps of path tracing: their positions, and the result of dragging one. A lamp slides on the sphere
 * around the specimen's centre on which it lies. Pure.
 */
import { Vector3 } from "three";
import type { Box } from "../math/box";
import type { Ray, Vec3 } from "../math/vec3";
import { AXES } from "../math/vec3";
import type { Action } from "../state/actions";
import { isTraced } from "../state/parameters/volumes";
import { LAMP_REACH } from "../state/path_trace_settings";
import type { ViewerState } from "../state/viewer_state";

export const LAMP_HANDLES = ["lamp-0", "lamp-1", "lamp-2"] as const;
export type LampHandleId = (typeof LAMP_HANDLES)[number];
/** A handle; its position is in um, world. */
export type LampHandle = Readonly<{ id: LampHandleId; position: Vec3 }>;
/** The part of the state that places lamps. */
export type LitState = Pick<ViewerState, "mode" | "areLampsShown" | "trace">;

/**
 * Angle, radians, by which a lamp moves beyond the sphere's rim, as the eye sees it, while the ray passes beside the
 * sphere. When the ray comes back to the sphere, the lamp is on its other side.
 */
export const TIP_RAD = (4 * Math.PI) / 180;

/** A point on the sphere; `isBeside` is true if the ray passes beside the sphere. */
export type Slid = Readonly<{ place: Vec3; isBeside: boolean }>;
/** The result of a drag; `action` is null if the lamp is already there. */
export type LampDrag = Readonly<{ action: Action | null; isBeside: boolean }>;

/** Smallest move of a lamp, in longest edges of the specimen. Smaller ones do not restart path tracing. */
const SAME = 1e-9;

export function isLampHandle(id: string): id is LampHandleId {
  return (LAMP_HANDLES as readonly string[]).includes(id);
}

/** Returns the handles of all lamps that are on, at the lamps' real positions; none while lamps are not shown. */
export function lampHandles(state: LitState, specimen: Box): readonly LampHandle[] {
  if (!isTraced(state) || !state.areLampsShown) return [];
  const { middle, edge_um } = roundOf(specimen);
  return LAMP_HANDLES.flatMap((id, i) => {
    const lamp = state.trace.lamps[i];
    if (!lamp?.isOn) return [];
    const position = new Vector3(lamp.x, lamp.y, lamp.z).multiplyScalar(edge_um).add(middle);
    return [{ id, position: position.toArray() }];
  });
}

/**
 * Returns the result of dragging a lamp to a ray (um); null if the lamp has no handle, or the ray defines no place.
 *
 * @param wasBeside whether the previous ray of the same drag passed beside the sphere
 */
export function dragLamp(
  id: LampHandleId,
  ray: Ray,
  state: LitState,
  specimen: Box,
  wasBeside: boolean,
): LampDrag | null {
  const { middle, edge_um } = roundOf(specimen);
  const isThere = lampHandles(state, specimen).some((each) => each.id === id);
  if (!isThere || !(edge_um > 0)) return null;
  const lamp = LAMP_HANDLES.indexOf(id);
  const { x, y, z } = state.trace.lamps[lamp];
  const origin = new Vector3(...ray.origin).sub(middle).divideScalar(edge_um).toArray();
  const slid = slideOnSphere([x, y, z], { origin, direction: ray.direction }, wasBeside);
  if (slid === null) return null;
  const place = withinReach(slid.place);
  const isSame = Math.hypot(place[0] - x, place[1] - y, place[2] - z) < SAME;
  const action: Action | null = isSame ? null : { type: "move-lamp", lamp, place };
  return { action, isBeside: slid.isBeside };
}

/**
 * Returns the place to which a point moves on its sphere around 0 when it follows a ray; null if the ray defines none.
 * If the ray meets the sphere at two places, the one nearer to the point counts. If it passes beside the sphere, the
 * point moves near the rim as seen from the ray's origin: first across the rim to the other side, then along it.
 */
export function slideOnSphere(
  from: Vec3,
  { origin, direction }: Ray,
  wasBeside: boolean,
): Slid | null {
  const point = new Vector3(...from);
  const eye = new Vector3(...origin);
  const ahead = new Vector3(...direction).normalize();
  const radius = point.length();
  if (!(radius > 0)) return null;
  const nearest = -eye.dot(ahead);
  const half = Math.sqrt(radius ** 2 - (eye.lengthSq() - nearest ** 2)); // NaN if the ray passes beside the sphere
  const ends = [nearest - half, nearest + half]
    .filter((t) => t > 0)
    .map((t) => eye.clone().addScaledVector(ahead, t));
  ends.sort((a, b) => a.distanceToSquared(point) - b.distanceToSquared(point));
  const place = ends[0] ?? atTheRim(point, eye, ahead, wasBeside);
  return place && { place: place.toArray(), isBeside: ends.length === 0 };
}

/** @param eye a point outside the sphere */
function atTheRim(
  point: Vector3,
  eye: Vector3,
  ahead: Vector3,
  wasBeside: boolean,
): Vector3 | null {
  const radius = point.length();
  const towards = eye.clone().normalize();
  const aside = ahead.clone().addScaledVector(towards, -ahead.dot(towards));
  if (!(aside.length() > 1e-6)) return null; // the ray leads straight to the sphere's centre or away from it
  aside.normalize();
  const rim = Math.acos(Math.min(1, radius / eye.length())); // angle at which a ray from the eye touches the sphere
  const wasBehind = towards.angleTo(point) > rim;
  const isBehind = wasBehind === wasBeside;
  const angle = Math.max(0, rim + (isBehind ? TIP_RAD : -TIP_RAD));
  return towards
    .multiplyScalar(radius * Math.cos(angle))
    .addScaledVector(aside, radius * Math.sin(angle));
}

/**
 * Returns a place at the same distance from the centre, within the lamps' reach along each axis. Coordinates beyond the
 * reach are limited to it, and the other coordinates grow to keep the distance.
 */
export function withinReach(place: Vec3): Vec3 {
  const far2 = place[0] ** 2 + place[1] ** 2 + place[2] ** 2;
  let parts = place;
  for (const _ of AXES) {
    const isFull = parts.map((v) => Math.abs(v) >= LAMP_REACH);
    if (parts.every((v) => Math.abs(v) <= LAMP_REACH)) break;
    const full = isFull.filter(Boolean).length;
    const left = Math.sqrt(Math.max(0, far2 - full * LAMP_REACH ** 2));
    const free = Math.hypot(...parts.map((v, i) => (isFull[i] ? 0 : v)));
    const part = (i: 0 | 1 | 2) => {
      if (isFull[i]) return Math.sign(parts[i]) * LAMP_REACH;
      return free > 0 ? (parts[i] * left) / free : left / Math.sqrt(3 - full);
    };
    parts = [part(0), part(1), part(2)];
  }
  return parts;
}

function roundOf({ min, max }: Box): Readonly<{ middle: Vector3; edge_um: number }> {
  const middle = new Vector3(...min).add(new Vector3(...max)).multiplyScalar(0.5);
  return { middle, edge_um: Math.max(...AXES.map((i) => max[i] - min[i])) };
}
