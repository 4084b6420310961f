/**
 * From the flat screen into the room and back: the point that the camera is turned about lies
 * straight ahead there, and the specimen turns the same side to the eyes. Pure.
 */
import { Quaternion, type Vector3 } from "three";
import { type HandPose, moveByOneHand, type SpecimenPose } from "../math/grab";

/**
 * @param screen the point that the camera is turned about, and the camera's turn
 * @param ahead_m where that point comes to lie in the room
 * @param facing of the eyes that look at it there
 */
export function intoRoom(
  pose: SpecimenPose,
  screen: HandPose,
  ahead_m: Vector3,
  facing = new Quaternion(),
): SpecimenPose {
  return moveByOneHand(pose, screen, { position: ahead_m, orientation: facing });
}

/** The inverse. */
export function ontoScreen(
  pose: SpecimenPose,
  screen: HandPose,
  ahead_m: Vector3,
  facing = new Quaternion(),
): SpecimenPose {
  return moveByOneHand(pose, { position: ahead_m, orientation: facing }, screen);
}
