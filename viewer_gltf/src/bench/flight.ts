/**
 * The way that a specimen takes before the eyes while frames are timed: once round, towards the eyes
 * and away again. The same in every run and on every device, by the share of its time. Pure.
 */
import type { Vec3 } from "../math/vec3";

/** How far it comes towards the eyes, as a share of the way to them. */
const NEAREST_SHARE = 0.45;
/** The most that it tips towards the eyes, rad. */
const TIP = 0.45;

export type FlightPose = Readonly<{
  /** The specimen's middle, m, in the room. */
  position: Vec3;
  /** x, y, z, w */
  orientation: readonly [number, number, number, number];
  scale: number;
}>;

/**
 * @param share 0..1 of the flight
 * @param eye where the eyes are, m
 * @param middle where the specimen's middle is at the start, m
 */
export function poseAt(share: number, eye: Vec3, middle: Vec3): FlightPose {
  const along = Math.min(1, Math.max(0, share));
  const near = NEAREST_SHARE * Math.sin(Math.PI * along) ** 2;
  const turn = Math.PI * along; // half of the angle
  const tip = (TIP / 2) * Math.sin(2 * Math.PI * along);
  const [sinY, cosY] = [Math.sin(turn), Math.cos(turn)];
  const [sinX, cosX] = [Math.sin(tip), Math.cos(tip)];
  return {
    position: [0, 1, 2].map((i) => middle[i] + near * (eye[i] - middle[i])) as unknown as Vec3,
    // tipped after it was turned
    orientation: [sinX * cosY, cosX * sinY, sinX * sinY, cosX * cosY],
    scale: 1,
  };
}
