/** Views that a user keeps, to go through them. Pure. */
import type { Vec3 } from "../math/vec3";

/** The flat camera, and the point that it is turned about; metres of the room. */
export type KeptView = Readonly<{
  position: Vec3;
  target: Vec3;
  /** The name of the stage's camera whose view this is; absent: the user has kept the view. */
  name?: string;
}>;

export const MAX_VIEWS = 24;
