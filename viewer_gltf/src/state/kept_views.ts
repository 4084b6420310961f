/** Views of the camera that a user keeps. Pure. */
import type { Vec3 } from "../math/vec3";

/** The flat camera and the point that it turns around, in metres of the scene. */
export type KeptView = Readonly<{
  position: Vec3;
  target: Vec3;
  /** Name of the camera of the stage that has this view; absent: the user kept the view. */
  name?: string;
}>;

export const MAX_VIEWS = 24;
