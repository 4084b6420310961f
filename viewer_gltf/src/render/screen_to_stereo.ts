/**
 * Converts the specimen's pose between the flat screen and stereo. The point about which the camera
 * turns lies straight ahead in stereo, and the same side of the specimen faces the eyes.
 */
import { Quaternion, type Vector3 } from "three";
import { type HandPose, moveByOneHand, type SpecimenPose } from "../math/grab";

/**
 * Converts a pose on the screen into stereo.
 *
 * @param screen the point about which the camera turns, and its orientation
 * @param ahead_m where that point lies in stereo, metres
 * @param facing orientation of the eyes
 */
export function intoStereo(
  pose: SpecimenPose,
  screen: HandPose,
  ahead_m: Vector3,
  facing = new Quaternion(),
): SpecimenPose {
  return moveByOneHand(pose, screen, { position: ahead_m, orientation: facing });
}

/** The inverse of `intoStereo`. */
export function ontoScreen(
  pose: SpecimenPose,
  screen: HandPose,
  ahead_m: Vector3,
  facing = new Quaternion(),
): SpecimenPose {
  return moveByOneHand(pose, { position: ahead_m, orientation: facing }, screen);
}
