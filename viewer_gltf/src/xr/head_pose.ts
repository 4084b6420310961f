/**
 * The pose of the head, between its eyes. three.js 0.187 leaves a session's camera at the left eye.
 * A gaze from there would be off by 1.8 degrees at one metre.
 */
import { Matrix4, type Object3D, Quaternion, Vector3 } from "three";

type Eye = Pick<Object3D, "matrixWorld">;

const [position, turn, size] = [new Vector3(), new Quaternion(), new Vector3()];

/**
 * Returns the pose midway between the eyes, written to `head`. If the displays are turned outwards,
 * both must be turned by the same angle.
 */
export function betweenEyes(eyes: readonly Eye[], head = new Matrix4()): Matrix4 {
  const [left, right] = eyes;
  if (left === undefined) return head.identity();
  if (right === undefined) return head.copy(left.matrixWorld);
  left.matrixWorld.decompose(position, turn, size);
  const [from, turned] = [position.clone(), turn.clone()];
  right.matrixWorld.decompose(position, turn, size);
  return head.compose(position.add(from).multiplyScalar(0.5), turn.slerp(turned, 0.5), ONE);
}

const ONE = new Vector3(1, 1, 1);

/**
 * The point at this distance in front of the head and at its height, even if the head looks up or
 * down.
 */
export function ahead(head: Matrix4, distance_m: number): Vector3 {
  const eye = new Vector3().setFromMatrixPosition(head);
  const gaze = new Vector3(0, 0, -1).transformDirection(head).setY(0);
  if (gaze.lengthSq() < 1e-6) gaze.set(0, 0, -1); // straight up or down
  return gaze.normalize().multiplyScalar(distance_m).add(eye);
}
