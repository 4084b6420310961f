/** Finds the eye in the specimen's space, for marks that look equally large at every distance. Pure. */
import { Matrix4, type PerspectiveCamera, Vector3 } from "three";
import { type EyeView, STEREO_TEXT, screenZoom } from "./style";

export const NO_EYE_VIEW: EyeView = {
  eye_um: new Vector3(),
  up: new Vector3(0, 1, 0),
  zoom: 1,
  textZoom: 1,
};

/**
 * @param head pose of the head or of the mono camera, in the scene
 * @param specimen from um to the scene
 * @param screen the flat picture, with its height in CSS pixels; null in stereo
 */
export function eyeViewOf(
  head: Matrix4,
  specimen: Matrix4,
  screen: Readonly<{ camera: PerspectiveCamera; height_px: number }> | null,
): EyeView {
  const toSpecimen = new Matrix4().copy(specimen).invert();
  const zoom = screen === null ? 1 : screenZoom(pxPerRad(screen.camera, screen.height_px));
  return {
    eye_um: new Vector3().setFromMatrixPosition(head).applyMatrix4(toSpecimen),
    up: new Vector3().setFromMatrixColumn(head, 1).transformDirection(toSpecimen),
    zoom,
    textZoom: screen === null ? STEREO_TEXT : zoom,
  };
}

/** CSS pixels for each radian at the centre of a flat screen. */
function pxPerRad(camera: PerspectiveCamera, height_px: number): number {
  return (camera.projectionMatrix.elements[5] * height_px) / 2;
}
