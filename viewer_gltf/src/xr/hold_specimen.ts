/** Hands that hold the specimen: one carries it, two carry, turn and scale it. Room, m. */
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
const TURN_DEG_PER_S = 90;
const ZOOM_PER_S = 2.5;
/** One step of a turn, radians: as the keys move the camera on a flat screen. */
const STEP_RAD = Math.PI / 12;
const ZOOM = 0.8;
const STEP_M = 0.1;
/** Turn by a finger that goes over the height of the screen, radians. */
const TURN_BY_FINGER_RAD = Math.PI;
/** Height of an eye's picture as a multiple of the distance: a Cardboard shows 40 degrees up and down. */
const HEIGHT_OF_VIEW = 2 * Math.tan(MathUtils.degToRad(40));
/** So near and so far the middle of what is shown may come, m: no way in leads out at the back. */
const NEAREST_M = 0.1;
const FARTHEST_M = 5;
/** So near to straight up or down a gaze carries the specimen no further, radians. */
const STEEPEST_RAD = MathUtils.degToRad(5);
/** Tilt of a head that holds the specimen. */
const HALF_NEARER_RAD = MathUtils.degToRad(12);
/** Steps in a second of a move that goes on. */
export const STEPS_PER_S = 3;

/** By holder: its pose now, null where tracking is lost. At most two count. */
export type Holders<K> = ReadonlyMap<K, HandPose | null>;

/**
 * The specimen after the hands have moved. A hand that has just taken hold, or is seen again,
 * moves nothing in its first frame.
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

/** The stick to the side turns about the vertical through `pivot`, forward comes nearer. */
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

/** The side of the specimen that a view is named by faces the viewer. */
const FACING: Readonly<Partial<Record<Command, Quaternion>>> = {
  front: new Quaternion(),
  side: about(UP, -Math.PI / 2),
  top: about(RIGHT, Math.PI / 2),
};
/** Whether a command turns the specimen at once, however far: the others go on by small steps. */
export function isFacing(command: Command): boolean {
  return FACING[command] !== undefined;
}

/** Where the camera would go to the left, the specimen turns to the right: about which axis. */
const TURNS: Readonly<Partial<Record<Command, readonly [Vector3, number]>>> = {
  "turn-left": [UP, STEP_RAD],
  "turn-right": [UP, -STEP_RAD],
  "turn-up": [RIGHT, STEP_RAD],
  "turn-down": [RIGHT, -STEP_RAD],
};

/** And to the right, where it would go to the left. */
const SHIFTS: Readonly<Partial<Record<Command, Vector3>>> = {
  "pan-left": new Vector3(STEP_M, 0, 0),
  "pan-right": new Vector3(-STEP_M, 0, 0),
  "pan-up": new Vector3(0, -STEP_M, 0),
  "pan-down": new Vector3(0, STEP_M, 0),
};

/**
 * In stereo nobody moves the eyes but the head, so that what would move a camera moves the
 * specimen: about `pivot`, or along the line from the eye to it. It comes nearer, as to a camera, and
 * does not grow: so the distance at which volumes take over can be walked through. Left and right are
 * those of an eye that looks at the pivot. null: the command is another's.
 *
 * @param share of a step
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
 * One finger turns the specimen about `pivot`, two bring it nearer and shift it with their middle.
 * It follows the fingers: what lies under one in each eye's picture goes with it.
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

/** The head that holds the specimen by the button, as it took hold. */
export type HeadHold = Readonly<{ pose: SpecimenPose; pivot: Vector3; gaze: Gaze }>;
type Gaze = Readonly<{ origin: Vector3; direction: Vector3 }>;

/** To the left, and up. */
function bearingOf({ direction: { x, y, z } }: Gaze): readonly [yaw: number, pitch: number] {
  return [Math.atan2(-x, -z), Math.atan2(y, Math.hypot(x, z))];
}

/**
 * The specimen goes round the eye with the head that holds it, the same side to it. Tilted down the head
 * brings it nearer, tilted up sends it away: by a half, or twice as far, for each HALF_NEARER_RAD.
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
 * The specimen goes as far aside, up or down as the gaze that carries it, the same side to the eye and at the
 * same distance.
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

/** With the pivot's distance from the eye multiplied by a factor, within limits. */
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
  // what hands have put beyond a limit goes no further, and does not jump
  const next = factor < 1 ? Math.min(distance, wanted) : Math.max(distance, wanted);
  const by = away.multiplyScalar(next / distance - 1);
  return { ...pose, position: pose.position.clone().add(by) };
}

/** The turn about the vertical of an eye that looks from `eye` to `pivot`; none straight below it. */
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
