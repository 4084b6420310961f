/** How far apart a headset's eyes are, as a share of what the headset has. */
import { type PerspectiveCamera, Vector3 } from "three";

const middle = new Vector3();
const eye = new Vector3();

/** Moves the cameras, as the session has just placed them, to or from the point between them. */
export function spreadEyes(cameras: readonly PerspectiveCamera[], strength: number): void {
  if (strength === 1 || cameras.length < 2) return;
  middle.set(0, 0, 0);
  for (const { matrix } of cameras) middle.add(eye.setFromMatrixPosition(matrix));
  middle.divideScalar(cameras.length);
  for (const { matrix } of cameras) {
    eye.setFromMatrixPosition(matrix).sub(middle).multiplyScalar(strength).add(middle);
    matrix.setPosition(eye);
  }
}
