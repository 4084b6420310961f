/** The pose of the flat camera and of the specimen, in metres of the scene. */
import type { Vec3 } from "../math/vec3";

/**
 * The specimen's centre, its rotation (quaternion x, y, z, w) and its size, as a multiple of the
 * size at the opening.
 */
export type SpecimenPlacement = Readonly<{
  position: Vec3;
  orientation: readonly [number, number, number, number];
  scale: number;
}>;

export type CameraView = Readonly<{
  /** Place of the camera, and the point that it turns around. */
  position: Vec3;
  target: Vec3;
  /** Pose of the specimen in the scene; null: the opening pose. */
  specimen: SpecimenPlacement | null;
}>;
