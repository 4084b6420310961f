/** Moves the specimen by hands, sticks, commands, fingers, or the head. Scene space, metres. */
import { MathUtils, Quaternion, Vector3 } from "three";
import {
  type HandPose,
  moveByOneHand,
  moveByTwoHands,
  type SpecimenPose,
  zoomAbout,
} from "../math/grab";
import type { Command } from "../state/commands";
import type { Gesture } from "./cardboard/fingers";
import type { Stick } from "./controllers";

const UP = new Vector3(0, 1, 0);
const RIGHT = new Vector3(1, 0, 0);
/** Degrees per second at full deflection of a stick. */
const TURN_DEG_PER_S = 90;
/** Scale factor per second at full deflection of a stick. */
const ZOOM_PER_S = 2.5;
/** Radians of one turning command; the same step as the keys use on a flat screen. */
const STEP_RAD = Math.PI / 12;
/** Factor of the distance for one zoom command. */
const ZOOM = 0.8;
/** Metres of one shifting command. */
const STEP_M = 0.1;
/** Radians turned by a finger that moves over the whole height of the screen. */
const TURN_BY_FINGER_RAD = Math.PI;
/**
 * Height of an eye's image as a multiple of the distance: a Cardboard shows 40 degrees up and 40
 * down.
 */
const HEIGHT_OF_VIEW = 2 * Math.tan(MathUtils.degToRad(40));
/**
 * Limits of the distance from the eye to the specimen's middle, metres, so that moving nearer does
 * not end behind the specimen.
 */
const NEAREST_M = 0.1;
const FARTHEST_M = 5;
/** Radians. A gaze that carries the specimen stops at this angle from straight up or down. */
const STEEPEST_RAD = MathUtils.degToRad(5);
/** Radians of tilt by which a head halves or doubles the distance of the specimen that it holds. */
const HALF_NEARER_RAD = MathUtils.degToRad(12);
export const STEPS_PER_S = 3;

/** Pose of each holder, or null where tracking is lost. At most two holders count. */
export type Holders<K> = ReadonlyMap<K, HandPose | null>;

/**
 * Returns the specimen's pose after the hands have moved. A hand that has just taken hold, or whose
 * tracking has returned, moves nothing in its first frame.
 */
export function moveByHolders<K>(
  pose: SpecimenPose,
  before: Holders<K>,
  after: Holders<K>,
): SpecimenPose {
  const moves: (readonly [HandPose, HandPose])[] = [];
  for (const [holder, now] of after) {
    const then = before.get(holder);
    if (then && now && moves.length < 2) moves.push([then, now]);
  }
  const [first, second] = moves;
  if (first === undefined) return pose;
  if (second === undefined) return moveByOneHand(pose, first[0], first[1]);
  return moveByTwoHands(pose, [first[0], second[0]], [first[1], second[1]]);
}

/**
 * Turns about the vertical through `pivot` by the stick's x, and zooms in when the stick is pushed
 * forward.
 */
export function moveByStick(
  pose: SpecimenPose,
  { x, y }: Stick,
  pivot: Vector3,
  dt_s: number,
): SpecimenPose {
  if (x === 0 && y === 0) return pose;
  const turn = about(UP, MathUtils.degToRad(TURN_DEG_PER_S) * x * dt_s);
  return zoomAbout(turnAbout(pose, turn, pivot), pivot, ZOOM_PER_S ** (-y * dt_s));
}

const FACING: Readonly<Partial<Record<Command, Quaternion>>> = {
  front: new Quaternion(),
  side: about(UP, -Math.PI / 2),
  top: about(RIGHT, Math.PI / 2),
};
/**
 * Whether a command turns the specimen to a named side in one jump; other commands move by small
 * steps.
 */
export function isFacing(command: Command): boolean {
  return FACING[command] !== undefined;
}

/** Axis and angle by which the specimen turns: opposite to the turn of a camera. */
const TURNS: Readonly<Partial<Record<Command, readonly [Vector3, number]>>> = {
  "turn-left": [UP, STEP_RAD],
  "turn-right": [UP, -STEP_RAD],
  "turn-up": [RIGHT, STEP_RAD],
  "turn-down": [RIGHT, -STEP_RAD],
};

/** Shift of the specimen: opposite to that of a camera. */
const SHIFTS: Readonly<Partial<Record<Command, Vector3>>> = {
  "pan-left": new Vector3(STEP_M, 0, 0),
  "pan-right": new Vector3(-STEP_M, 0, 0),
  "pan-up": new Vector3(0, -STEP_M, 0),
  "pan-down": new Vector3(0, STEP_M, 0),
};

/**
 * Applies a camera command to the specimen, because in stereo only the head moves the eyes.
 * The specimen turns about `pivot`, or moves along the line from the eye to it. It comes nearer
 * without growing, so that it crosses the distance at which volumes are shown. Left and right are
 * as seen by an eye that looks at the pivot. Returns null if the command is not one of these.
 *
 * @param share share of a step
 */
export function moveByCommand(
  pose: SpecimenPose,
  command: Command,
  pivot: Vector3,
  eye: Vector3,
  share = 1,
): SpecimenPose | null {
  const facing = FACING[command];
  if (facing !== undefined) {
    return turnAbout(pose, facing.clone().multiply(pose.orientation.clone().invert()), pivot);
  }
  const toEye = headingTo(pivot, eye);
  const turn = TURNS[command];
  if (turn !== undefined) {
    const [axis, angle] = turn;
    return turnAbout(pose, about(axis.clone().applyQuaternion(toEye), share * angle), pivot);
  }
  const shift = SHIFTS[command]?.clone().multiplyScalar(share).applyQuaternion(toEye);
  if (shift !== undefined) return { ...pose, position: pose.position.clone().add(shift) };
  if (command === "zoom-in") return bringNearer(pose, pivot, eye, ZOOM ** share);
  if (command === "zoom-out") return bringNearer(pose, pivot, eye, ZOOM ** -share);
  return null;
}

/**
 * One finger turns the specimen about `pivot`; two bring it nearer and shift it with their
 * midpoint. The shift follows the fingers: the point under a finger in the eye's image stays under
 * it.
 */
export function moveByFingers(
  pose: SpecimenPose,
  gesture: Gesture,
  pivot: Vector3,
  eye: Vector3,
): SpecimenPose {
  if (gesture.kind !== "drag" && gesture.kind !== "pinch") return pose;
  const { x, y } = gesture;
  const toEye = headingTo(pivot, eye);
  if (gesture.kind === "drag") {
    const right = RIGHT.clone().applyQuaternion(toEye);
    const turn = about(UP, TURN_BY_FINGER_RAD * x).multiply(about(right, TURN_BY_FINGER_RAD * y));
    return turnAbout(pose, turn, pivot);
  }
  const near = bringNearer(pose, pivot, eye, 1 / gesture.factor);
  const height_m = pivot.distanceTo(eye) * HEIGHT_OF_VIEW;
  const shift = new Vector3(x, -y, 0).multiplyScalar(height_m).applyQuaternion(toEye);
  return { ...near, position: near.position.clone().add(shift) };
}

/** State at the moment when the head began to hold the specimen. */
export type HeadHold = Readonly<{ pose: SpecimenPose; pivot: Vector3; gaze: Gaze }>;
type Gaze = Readonly<{ origin: Vector3; direction: Vector3 }>;

/** Angles of a gaze: to the left and up. */
function bearingOf({ direction: { x, y, z } }: Gaze): readonly [yaw: number, pitch: number] {
  return [Math.atan2(-x, -z), Math.atan2(y, Math.hypot(x, z))];
}

/**
 * Moves the specimen around the eye with the head that holds it, with the same side facing the eye.
 * Tilting the head down by HALF_NEARER_RAD halves the distance; tilting up doubles it.
 */
export function moveByHead({ pose, pivot, gaze: before }: HeadHold, gaze: Gaze): SpecimenPose {
  const [yaw, pitch] = bearingOf(gaze);
  const [yawBefore, pitchBefore] = bearingOf(before);
  const turn = about(UP, yaw - yawBefore);
  const eye = gaze.origin;
  const still = { position: before.origin, orientation: new Quaternion() };
  const carried = moveByOneHand(pose, still, { position: eye, orientation: turn });
  const at = pivot.clone().sub(before.origin).applyQuaternion(turn).add(eye);
  return bringNearer(carried, at, eye, 2 ** ((pitch - pitchBefore) / HALF_NEARER_RAD));
}

/**
 * Moves the specimen sideways, up or down by the turn of the gaze that carries it, at the same
 * distance and with the same side facing the eye.
 */
export function moveByGaze({ pose, pivot, gaze: before }: HeadHold, gaze: Gaze): SpecimenPose {
  const [yaw, pitch] = bearingOf(gaze);
  const [yawBefore, pitchBefore] = bearingOf(before);
  const away = pivot.clone().sub(before.origin);
  const [yawOfPivot, pitchOfPivot] = bearingOf({ origin: before.origin, direction: away });
  const steepest = Math.PI / 2 - STEEPEST_RAD;
  const up = MathUtils.clamp(pitchOfPivot + pitch - pitchBefore, -steepest, steepest);
  const aside = yawOfPivot + yaw - yawBefore;
  const at = new Vector3(
    -Math.sin(aside) * Math.cos(up),
    Math.sin(up),
    -Math.cos(aside) * Math.cos(up),
  )
    .multiplyScalar(away.length())
    .add(gaze.origin);
  const turned = turnAbout(pose, about(UP, yaw - yawBefore), pivot);
  return { ...turned, position: turned.position.clone().add(at).sub(pivot) };
}

/** Multiplies the distance from the eye to the pivot by a factor, within limits. */
function bringNearer(
  pose: SpecimenPose,
  pivot: Vector3,
  eye: Vector3,
  factor: number,
): SpecimenPose {
  const away = pivot.clone().sub(eye);
  const distance = away.length();
  if (distance === 0) return pose;
  const wanted = MathUtils.clamp(distance * factor, NEAREST_M, FARTHEST_M);
  // a pivot that hands put beyond a limit neither moves farther out nor jumps back
  const next = factor < 1 ? Math.min(distance, wanted) : Math.max(distance, wanted);
  const by = away.multiplyScalar(next / distance - 1);
  return { ...pose, position: pose.position.clone().add(by) };
}

/**
 * Turn about the vertical of an eye that looks from `eye` to `pivot`; the identity if it looks
 * straight up or down.
 */
function headingTo(pivot: Vector3, eye: Vector3): Quaternion {
  const { x, z } = pivot.clone().sub(eye);
  return about(UP, Math.hypot(x, z) < NEAREST_M ? 0 : Math.atan2(-x, -z));
}

function about(axis: Vector3, angle: number): Quaternion {
  return new Quaternion().setFromAxisAngle(axis, angle);
}

function turnAbout(pose: SpecimenPose, turn: Quaternion, pivot: Vector3): SpecimenPose {
  const still = { position: pivot, orientation: new Quaternion() };
  return moveByOneHand(pose, still, { position: pivot, orientation: turn });
}
