/**
 * The handles of clip box and plane: where they are, what a drag does; and which handle of all, the
 * lamps' too, a ray means. Pure.
 */
import { Vector3 } from "three";
import type { Box } from "../math/box";
import {
  type BoxHandle,
  boxHandles,
  type Clip,
  type ClipPlane,
  dragBox,
  planeHandles,
  type Side,
  slidePlane,
  turnPlane,
} from "../math/clip";
import type { Ray, Vec3 } from "../math/vec3";
import { AXES } from "../math/vec3";
import type { Action } from "../state/actions";
import type { LampHandleId } from "./lamp_handles";
import { HANDLE_RADIUS } from "./style";

export const BOX_HANDLES = ["x-min", "x-max", "y-min", "y-max", "z-min", "z-max"] as const;
export const PLANE_HANDLES = ["plane-middle", "plane-tip"] as const;
export type BoxHandleId = (typeof BOX_HANDLES)[number];
export type Face = Pick<BoxHandle, "axis" | "side">;
export type ClipHandleId = BoxHandleId | (typeof PLANE_HANDLES)[number];
export type ClipHandle = Readonly<{ id: ClipHandleId; position: Vec3 }>;
export type HandleId = ClipHandleId | LampHandleId;
export type Handle = Readonly<{ id: HandleId; position: Vec3 }>;

/** Angle around a handle's middle within which a ray means it, radians, by the pointer. */
export const TOLERANCE_RAD = {
  mouse: 1.3 * HANDLE_RADIUS,
  touch: 2.2 * HANDLE_RADIUS,
  /** And a hand's ray: both tremble. */
  gaze: 2.8 * HANDLE_RADIUS,
} as const;
export type Pointing = keyof typeof TOLERANCE_RAD;

/** Length of the plane's arm, as a share of the longest edge of what is shown. */
const ARM = 0.2;

export function armOf({ min, max }: Box): number {
  return ARM * Math.max(...AXES.map((i) => max[i] - min[i]));
}

/** The clip box as far as it lies in what is shown; itself if it lies beside that. */
export function boxWithin(box: Box, shown: Box): Box {
  const min = AXES.map((i) => Math.max(box.min[i], shown.min[i]));
  const max = AXES.map((i) => Math.min(box.max[i], shown.max[i]));
  if (AXES.some((i) => min[i] >= max[i])) return box;
  return { min: [min[0], min[1], min[2]], max: [max[0], max[1], max[2]] };
}

/** All handles of the clip. `shown`: box of what is shown, um: the specimen, or the isolated tile. */
export function handlesOf({ box, plane }: Clip, shown: Box): readonly ClipHandle[] {
  const found: ClipHandle[] = [];
  if (box !== null) {
    for (const { axis, side, position } of boxHandles(boxWithin(box, shown))) {
      found.push({ id: idOf(axis, side), position });
    }
  }
  if (plane !== null) {
    const { middle, tip } = planeHandles(plane, shown, armOf(shown));
    found.push({ id: "plane-middle", position: middle }, { id: "plane-tip", position: tip });
  }
  return found;
}

const NOTHING_CUT: Clip = { box: null, plane: null };

/**
 * The clip whose marks show. Those of the cut that a page opens with would lie over what it opens:
 * they wait until somebody points at the picture, or moves the cut.
 */
export function markedClip(clip: Clip, opening: Clip, isPointedAt: boolean): Clip {
  return clip === opening && !isPointedAt ? NOTHING_CUT : clip;
}

/** The handle that the ray (um) passes at the smallest angle, within a tolerance. */
export function pickHandle(
  ray: Ray,
  handles: readonly Handle[],
  tolerance_rad: number,
): HandleId | null {
  const origin = new Vector3(...ray.origin);
  const direction = new Vector3(...ray.direction);
  let nearest = tolerance_rad;
  let picked: HandleId | null = null;
  for (const { id, position } of handles) {
    const angle = new Vector3(...position).sub(origin).angleTo(direction);
    if (angle > nearest) continue;
    nearest = angle;
    picked = id;
  }
  return picked;
}

/** The clip after dragging a handle to a ray (um); null: no change. */
export function dragHandle(id: ClipHandleId, ray: Ray, clip: Clip, shown: Box): Action | null {
  if (id === "plane-middle") return changePlane(clip, (plane) => slidePlane(plane, ray, shown));
  if (id === "plane-tip") {
    return changePlane(clip, (plane) => turnPlane(plane, ray, shown, armOf(shown)));
  }
  return changeFace(clip, id, shown, (seen, face) => dragBox(seen, face, ray, shown));
}

export function changePlane(
  { box, plane }: Clip,
  change: (plane: ClipPlane) => ClipPlane,
): Action | null {
  const changed = plane && change(plane);
  return changed === plane ? null : { type: "set-clip", clip: { box, plane: changed } };
}

/** @param change gets the box as far as it is shown */
export function changeFace(
  { box, plane }: Clip,
  id: BoxHandleId,
  shown: Box,
  change: (seen: Box, face: Face) => Box,
): Action | null {
  if (box === null) return null;
  const { axis, side } = faceOf(id);
  const seen = boxWithin(box, shown);
  const place = change(seen, { axis, side })[side][axis];
  if (place === seen[side][axis]) return null;
  // the faces that nobody touches stay where they are, also outside of what is shown
  const corner: [number, number, number] = [...box[side]];
  corner[axis] = place;
  return { type: "set-clip", clip: { box: { ...box, [side]: corner }, plane } };
}

function idOf(axis: 0 | 1 | 2, side: Side): BoxHandleId {
  return BOX_HANDLES[2 * axis + (side === "max" ? 1 : 0)];
}

export function faceOf(id: BoxHandleId): Face {
  const index = BOX_HANDLES.indexOf(id);
  return { axis: AXES[index >> 1], side: index % 2 === 1 ? "max" : "min" };
}
