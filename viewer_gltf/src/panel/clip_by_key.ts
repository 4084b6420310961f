/**
 * Changes the cuts by keys. One part of a cut is chosen, and two keys move or turn it within the
 * limits of its handle. Pure.
 */
import {
  BOX_HANDLES,
  type BoxHandleId,
  changeFace,
  changePlane,
  faceOf,
  type HandleId,
} from "../marks/clip_handles";
import type { Box } from "../math/box";
import { type Clip, moveFace, movePlane, spinPlane } from "../math/clip";
import { distanceText } from "../math/length_text";
import { AXES } from "../math/vec3";
import type { Action } from "../state/actions";

const TURNS = ["turn-x", "turn-y", "turn-z"] as const;
type Turn = (typeof TURNS)[number];
/**
 * A face of the box, the plane along its normal, or the rotation of the plane about an axis of the
 * specimen.
 */
export type ClipPart = BoxHandleId | "plane-middle" | Turn;

/**
 * Distance that one press of a key moves a face or the plane, as a share of the shown box's edge.
 */
const STEP = 0.02;
const STEP_RAD = Math.PI / 36;
const AXIS_NAMES = ["x", "y", "z"] as const;

export function clipPartsOf({ box, plane }: Clip): readonly ClipPart[] {
  return [
    ...(box === null ? [] : BOX_HANDLES),
    ...(plane === null ? [] : (["plane-middle", ...TURNS] as const)),
  ];
}

/**
 * Returns the part of the cuts that the keys change: the picked one if it still exists, else the
 * first.
 */
export function chosenClipPart(clip: Clip, picked: ClipPart | null): ClipPart | undefined {
  const clipParts = clipPartsOf(clip);
  return clipParts.find((clipPart) => clipPart === picked) ?? clipParts[0];
}

/** Returns the handle in the scene that moves the same part of the cuts. */
export function handleOf(clipPart: ClipPart): HandleId {
  return isTurn(clipPart) ? "plane-tip" : clipPart;
}

/**
 * @param steps number of steps; negative: backwards @returns the cuts after the move; null: the
 * part is at its limit
 */
export function moveClipPart(
  clipPart: ClipPart,
  steps: number,
  clip: Clip,
  shown: Box,
): Action | null {
  const edge = (axis: 0 | 1 | 2) => shown.max[axis] - shown.min[axis];
  if (isTurn(clipPart)) {
    const axis = AXES[TURNS.indexOf(clipPart)];
    return changePlane(clip, (plane) => spinPlane(plane, axis, steps * STEP_RAD, shown));
  }
  if (clipPart === "plane-middle") {
    const by_um = steps * STEP * Math.max(...AXES.map(edge));
    return changePlane(clip, (plane) => movePlane(plane, by_um, shown));
  }
  return changeFace(clip, clipPart, shown, (seen, face) =>
    moveFace(seen, face, steps * STEP * edge(face.axis), shown),
  );
}

export function clipPartName(clipPart: ClipPart): string {
  if (clipPart === "plane-middle") return "The plane, along its normal";
  if (isTurn(clipPart)) return `The plane, turned about ${clipPart.at(-1)}`;
  const { axis, side } = faceOf(clipPart);
  return `The box, ${side === "min" ? "lower" : "upper"} end of ${AXIS_NAMES[axis]}`;
}

/** Returns the announcement of a change of the cuts; a change of one part names that part only. */
export function cutText(before: Clip, after: Clip): string {
  const { box, plane } = after;
  if ((before.box === null) !== (box === null) || (before.plane === null) !== (plane === null)) {
    const cuts = [box && "a box", plane && "a plane"].filter(Boolean).join(" and ");
    return cuts === "" ? "Not cut" : `Cut by ${cuts}`;
  }
  for (const clipPart of BOX_HANDLES) {
    const { axis, side } = faceOf(clipPart);
    const place = box?.[side][axis];
    if (place === undefined || place === before.box?.[side][axis]) continue;
    return `Box: ${AXIS_NAMES[axis]} ${side === "min" ? "from" : "to"} ${placeText(place)}`;
  }
  if (plane === null) return "";
  const { normal, offset_um } = plane;
  const isTurned = normal.some((v, i) => v !== before.plane?.normal[i]);
  if (!isTurned) return `Plane at ${placeText(offset_um)}`;
  return `Plane faces ${normal.map((v) => Number(v.toFixed(2)) + 0).join(", ")}`; // adding 0 turns -0 into 0
}

function placeText(place_um: number): string {
  return `${place_um < 0 ? "-" : ""}${distanceText(Math.abs(place_um))}`;
}

function isTurn(clipPart: ClipPart): clipPart is Turn {
  return clipPart.startsWith("turn-");
}
