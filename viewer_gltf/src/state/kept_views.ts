/** Views that a user keeps, to go through them. Pure. */
import type { Vec3 } from "../math/vec3";

/** The flat camera, and the point that it is turned about; metres of the room. */
export type KeptView = Readonly<{
  position: Vec3;
  target: Vec3;
  /** Of the stage's camera that it is; absent: the user has kept it. */
  name?: string;
}>;

export const MAX_VIEWS = 24;
