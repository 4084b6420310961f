/**
 * The specimen's flight while frames are timed: it turns once around, moves towards the eyes and away again. Its pose
 * depends only on the share of the flight's time, so that all runs and devices show the same. Pure.
 */
import type { Vec3 } from "../math/vec3";

/** Largest movement towards the eyes, as a share of the distance to them. */
const NEAREST_SHARE = 0.45;
/** Largest tilt towards the eyes, rad. */
const TIP = 0.45;

export type FlightPose = Readonly<{
  /** The specimen's centre in the scene, m. */
  position: Vec3;
  /** Quaternion x, y, z, w. */
  orientation: readonly [number, number, number, number];
  scale: number;
}>;

/**
 * Returns the specimen's pose.
 *
 * @param share of the flight's time, 0..1
 * @param eye place between the eyes, m
 * @param middle the specimen's centre at the start, m
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
    // The specimen is first turned about y, then tilted about x.
    orientation: [sinX * cosY, cosX * sinY, sinX * sinY, cosX * cosY],
    scale: 1,
  };
}
