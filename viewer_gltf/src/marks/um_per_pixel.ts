/** Computes the length of the specimen that a pixel of the screen shows. Pure. */
import type { PerspectiveCamera, Vector3 } from "three";
import { umPerPixel } from "../math/round_length";

/**
 * Returns um per CSS pixel at the depth of a point of the scene.
 *
 * @param height_px height of the view, CSS pixels
 */
export function umPerPixelAt(
  focus: Vector3,
  camera: PerspectiveCamera,
  height_px: number,
  m_per_um: number,
): number {
  const depth_m = -focus.clone().applyMatrix4(camera.matrixWorldInverse).z;
  const fov_rad = 2 * Math.atan(1 / camera.projectionMatrix.elements[5]);
  return umPerPixel(depth_m, fov_rad, height_px, m_per_um);
}
