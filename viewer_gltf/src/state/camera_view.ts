/** From where the specimen is seen. Metres of the room. */
import type { Vec3 } from "../math/vec3";

/** The specimen's centre, its turn (a quaternion x, y, z, w), a multiple of its usual size. */
export type SpecimenLook = Readonly<{
  position: Vec3;
  orientation: readonly [number, number, number, number];
  scale: number;
}>;

export type CameraView = Readonly<{
  /** The camera, and the point that it is turned about. */
  position: Vec3;
  target: Vec3;
  /** null: where it opens. */
  specimen: SpecimenLook | null;
}>;
