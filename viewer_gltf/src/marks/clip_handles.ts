/**
 * The handles of clip box and clip plane: their positions, and the result of a drag. Also finds the handle, including
 * those of lamps, at which a ray points. Pure.
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

/** Largest angle between a ray and a handle that it points at, radians, by the kind of pointer. */
export const TOLERANCE_RAD = {
  mouse: 1.3 * HANDLE_RADIUS,
  touch: 2.2 * HANDLE_RADIUS,
  /** Tolerance for the gaze and for a hand's ray, because head and hand both tremble. */
  gaze: 2.8 * HANDLE_RADIUS,
} as const;
export type Pointing = keyof typeof TOLERANCE_RAD;

/** Length of the plane's arm, as a share of the longest edge of the shown box. */
const ARM = 0.2;

export function armOf({ min, max }: Box): number {
  return ARM * Math.max(...AXES.map((i) => max[i] - min[i]));
}

/** Returns the part of the clip box within the shown box; the whole clip box if they do not overlap. */
export function boxWithin(box: Box, shown: Box): Box {
  const min = AXES.map((i) => Math.max(box.min[i], shown.min[i]));
  const max = AXES.map((i) => Math.min(box.max[i], shown.max[i]));
  if (AXES.some((i) => min[i] >= max[i])) return box;
  return { min: [min[0], min[1], min[2]], max: [max[0], max[1], max[2]] };
}

/** Returns all handles of the clip. `shown` is the box of the specimen or of the isolated tile, um. */
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
 * Returns the clip whose marks show. Marks of the cut with which a page opens would cover what the cut reveals. They
 * show only after a user points at the view or moves the cut.
 */
export function markedClip(clip: Clip, opening: Clip, isPointedAt: boolean): Clip {
  return clip === opening && !isPointedAt ? NOTHING_CUT : clip;
}

/** Returns the handle at the smallest angle from the ray (um); null if no handle is within the tolerance. */
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

/** Returns the action for dragging a handle to a ray (um); null if nothing changes. */
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

/** @param change receives the part of the box that is shown */
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
  // Only the dragged face moves. The other faces of the clip box stay in place, even if they lie
  // outside the shown box.
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
