/**
 * Moves the specimen by hand. One hand holds it like an object; two hands carry, turn and stretch
 * it about the point between them. Arguments are not changed.
 */
import { MathUtils, Matrix4, Quaternion, Vector3 } from "three";

/** Pose of a hand or controller in the scene, metres. */
export type HandPose = Readonly<{ position: Vector3; orientation: Quaternion }>;
export type Hands = readonly [HandPose, HandPose];

/**
 * Pose of the specimen: its centre in the scene, metres, and its size as a multiple of the initial
 * size.
 */
export type SpecimenPose = Readonly<{
  position: Vector3;
  orientation: Quaternion;
  scale: number;
}>;

export const SMALLEST_SCALE = 0.05;
export const LARGEST_SCALE = 50;
/** Metres. Hands closer than this give no direction and no change of size. */
const NEAR_M = 0.01;

export function poseMatrix(pose: SpecimenPose): Matrix4 {
  const scale = new Vector3().setScalar(pose.scale);
  return new Matrix4().compose(pose.position, pose.orientation, scale);
}

/** Moves the specimen with one hand, so that it stays in place in the hand. */
export function moveByOneHand(pose: SpecimenPose, before: HandPose, after: HandPose): SpecimenPose {
  const turn = after.orientation.clone().multiply(before.orientation.clone().invert());
  return moved(pose, before.position, after.position, turn, 1);
}

/**
 * Moves the specimen by the similarity that takes the line between the hands from before to after:
 * its middle, direction and length. About that line the specimen turns by the mean roll of both
 * hands.
 */
export function moveByTwoHands(pose: SpecimenPose, before: Hands, after: Hands): SpecimenPose {
  const [from, to] = [between(before), between(after)];
  const isNear = from.length() < NEAR_M || to.length() < NEAR_M;
  const turn = isNear ? new Quaternion() : turnBetween(from, to, before, after);
  const factor = isNear ? 1 : to.length() / from.length();
  return moved(pose, middle(before), middle(after), turn, factor);
}

/** Scales about `pivot`, a point of the scene in metres, which stays in place. */
export function zoomAbout(pose: SpecimenPose, pivot: Vector3, factor: number): SpecimenPose {
  return moved(pose, pivot, pivot, new Quaternion(), factor);
}

/**
 * Keeps the specimen near the user: its scale within limits, its centre within `farthest_m` of the
 * user. A pose with NaN, from a controller that lost its tracking, is replaced by `home`.
 */
export function limitPlacement(
  pose: SpecimenPose,
  viewer: Vector3,
  farthest_m: number,
  home: SpecimenPose,
): SpecimenPose {
  const { position, orientation } = pose;
  if (![...position, ...orientation, pose.scale].every(Number.isFinite)) return home;
  const scale = limitScale(pose.scale);
  const fromViewer = position.clone().sub(viewer);
  const isNear = fromViewer.length() <= farthest_m;
  if (isNear && scale === pose.scale) return pose;
  return { position: fromViewer.clampLength(0, farthest_m).add(viewer), orientation, scale };
}

function limitScale(scale: number): number {
  return MathUtils.clamp(scale, SMALLEST_SCALE, LARGEST_SCALE);
}

/**
 * Turns and scales about `from`, then moves `from` to `to`. At the limit of the scale nothing
 * drifts.
 */
function moved(
  pose: SpecimenPose,
  from: Vector3,
  to: Vector3,
  turn: Quaternion,
  factor: number,
): SpecimenPose {
  const scale = limitScale(pose.scale * factor);
  const arm = pose.position.clone().sub(from);
  return {
    position: arm
      .applyQuaternion(turn)
      .multiplyScalar(scale / pose.scale)
      .add(to),
    orientation: turn.clone().multiply(pose.orientation).normalize(),
    scale,
  };
}

function between([left, right]: Hands): Vector3 {
  return right.position.clone().sub(left.position);
}

function middle([left, right]: Hands): Vector3 {
  return left.position.clone().add(right.position).multiplyScalar(0.5);
}

/** The shortest turn of the line between the hands, after the hands' own roll about it. */
function turnBetween(from: Vector3, to: Vector3, before: Hands, after: Hands): Quaternion {
  const axis = from.clone().normalize();
  const swing = new Quaternion().setFromUnitVectors(axis, to.clone().normalize());
  const rolls = [0, 1].map((i) => {
    const hand = after[i].orientation.clone().multiply(before[i].orientation.clone().invert());
    return rollAbout(axis, swing.clone().invert().multiply(hand));
  });
  const roll = new Quaternion().setFromAxisAngle(axis, (rolls[0] + rolls[1]) / 2);
  return swing.multiply(roll);
}

/** The part of a turn about an axis (swing-twist decomposition), -pi to pi. */
function rollAbout(axis: Vector3, turn: Quaternion): number {
  const along = axis.dot(new Vector3(turn.x, turn.y, turn.z));
  const angle = 2 * Math.atan2(along, turn.w);
  return angle > Math.PI ? angle - 2 * Math.PI : angle < -Math.PI ? angle + 2 * Math.PI : angle;
}
