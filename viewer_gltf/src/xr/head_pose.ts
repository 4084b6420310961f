/**
 * Where the head is: between its eyes. three 0.187 leaves the camera of a session at the left eye,
 * from which a gaze would be 1.8 degrees beside what both eyes look at, one metre away.
 */
import { Matrix4, type Object3D, Quaternion, Vector3 } from "three";

type Eye = Pick<Object3D, "matrixWorld">;

const [position, turn, size] = [new Vector3(), new Quaternion(), new Vector3()];

/** @param head is set; displays may be turned outwards, each by as much */
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

/** The point so far ahead of the head, at its height, wherever up or down it looks. */
export function ahead(head: Matrix4, distance_m: number): Vector3 {
  const eye = new Vector3().setFromMatrixPosition(head);
  const gaze = new Vector3(0, 0, -1).transformDirection(head).setY(0);
  if (gaze.lengthSq() < 1e-6) gaze.set(0, 0, -1); // straight up or down
  return gaze.normalize().multiplyScalar(distance_m).add(eye);
}
