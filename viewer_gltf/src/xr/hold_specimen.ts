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
import type { Stick } from "./controllers";

const UP = new Vector3(0, 1, 0);
const RIGHT = new Vector3(1, 0, 0);
const TURN_DEG_PER_S = 90;
const ZOOM_PER_S = 2.5;
/** One step of a turn, radians: as the keys move the camera on a flat screen. */
const STEP_RAD = Math.PI / 12;
const ZOOM = 0.8;
const STEP_M = 0.1;

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
/** Where the camera would go to the left, the specimen turns to the right. */
const TURNS: Readonly<Partial<Record<Command, Quaternion>>> = {
  "turn-left": about(UP, STEP_RAD),
  "turn-right": about(UP, -STEP_RAD),
  "turn-up": about(RIGHT, STEP_RAD),
  "turn-down": about(RIGHT, -STEP_RAD),
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
 * specimen, about `pivot`. null: the command is another's.
 */
export function moveByCommand(
  pose: SpecimenPose,
  command: Command,
  pivot: Vector3,
): SpecimenPose | null {
  const facing = FACING[command];
  if (facing !== undefined) {
    return turnAbout(pose, facing.clone().multiply(pose.orientation.clone().invert()), pivot);
  }
  const turn = TURNS[command];
  if (turn !== undefined) return turnAbout(pose, turn, pivot);
  const shift = SHIFTS[command];
  if (shift !== undefined) return { ...pose, position: pose.position.clone().add(shift) };
  if (command === "zoom-in") return zoomAbout(pose, pivot, 1 / ZOOM);
  if (command === "zoom-out") return zoomAbout(pose, pivot, ZOOM);
  return null;
}

function about(axis: Vector3, angle: number): Quaternion {
  return new Quaternion().setFromAxisAngle(axis, angle);
}

function turnAbout(pose: SpecimenPose, turn: Quaternion, pivot: Vector3): SpecimenPose {
  const still = { position: pivot, orientation: new Quaternion() };
  return moveByOneHand(pose, still, { position: pivot, orientation: turn });
}
