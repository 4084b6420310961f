/** Changes the distance between a headset's eyes, as a share of the headset's own distance. */
import { type PerspectiveCamera, Vector3 } from "three";

const middle = new Vector3();
const eye = new Vector3();

/** Moves the cameras, which the session has just placed, along the line between them. */
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
