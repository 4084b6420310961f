/** The views from which paths start, in the space of the box, and how far they have moved since. Pure. */
import { Matrix3, Matrix4, type PerspectiveCamera, Quaternion, Vector3 } from "three";

export type TraceView = Readonly<{
  /** Matrices from normalised device coordinates to um in the box's space, and back. */
  toBox: Matrix4;
  fromBox: Matrix4;
  eye: Vector3;
}>;

/** @param box matrix from um in the box's space to the scene */
export function viewOf(camera: PerspectiveCamera, box: Matrix4): TraceView {
  const fromBox = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).multiply(box);
  const eye = new Vector3()
    .setFromMatrixPosition(camera.matrixWorld)
    .applyMatrix4(box.clone().invert());
  return { toBox: fromBox.clone().invert(), fromBox, eye };
}

/** Returns the rotation of a matrix, without its scale. */
export function turnOf(matrix: Matrix4): Matrix3 {
  const turn = new Quaternion();
  matrix.decompose(new Vector3(), turn, new Vector3());
  return new Matrix3().setFromMatrix4(new Matrix4().makeRotationFromQuaternion(turn));
}

/**
 * Use of earlier frames for the current view: `none` if their samples are useless, and `same` if all can be kept. With
 * `aside` the view has moved a little, so samples are kept for pixels that show the same place.
 */
export type History = "none" | "same" | "aside";

export function areSame(a: readonly TraceView[], b: readonly TraceView[]): boolean {
  return a.length === b.length && a.every(({ fromBox }, k) => fromBox.equals(b[k].fromBox));
}

/** Largest rotation of a head at rest, degrees. */
const TREMBLE_DEG = 0.3;
/** Largest movement of a head at rest, as a share of its distance to the box's centre. */
const TREMBLE_SHARE = 0.006;

/** Returns whether the eyes have moved no more than those of a head at rest. */
export function areNear(
  before: readonly TraceView[],
  now: readonly TraceView[],
  middle: Vector3,
): boolean {
  return before.length === now.length && now.every((view, k) => isNear(before[k], view, middle));
}

function isNear(before: TraceView, now: TraceView, middle: Vector3): boolean {
  const away = Math.max(now.eye.distanceTo(middle), 1e-9);
  const aheadOf = ({ toBox, eye }: TraceView) =>
    new Vector3(0, 0, 1).applyMatrix4(toBox).sub(eye).normalize();
  const turned_deg = (aheadOf(before).angleTo(aheadOf(now)) * 180) / Math.PI;
  const rolled = [before, now].map(({ toBox }) =>
    new Vector3(1, 0, 1)
      .applyMatrix4(toBox)
      .sub(new Vector3(-1, 0, 1).applyMatrix4(toBox))
      .normalize(),
  );
  const rolled_deg = (rolled[0].angleTo(rolled[1]) * 180) / Math.PI;
  return (
    Math.max(turned_deg, rolled_deg) <= TREMBLE_DEG &&
    before.eye.distanceTo(now.eye) <= TREMBLE_SHARE * away
  );
}

/** The views of earlier frames. */
export type ViewsBefore = Readonly<{
  /** The views from which the gathered paths begin. */
  anchors: readonly TraceView[];
  /** The views of the previous frame; empty: that frame gathered too few samples. */
  seen: readonly TraceView[];
  /** Centre of the box, um. */
  middle: Vector3;
  /** Whether paths may keep beginning at the anchors while the eyes only tremble. */
  mayTremble: boolean;
}>;

/** Returns which samples of earlier frames can be kept for the current views. */
export function historyOf(
  views: readonly TraceView[],
  { anchors, seen, middle, mayTremble }: ViewsBefore,
): History {
  if (anchors.length !== views.length) return "none";
  if (areSame(anchors, views)) return "same";
  if (areNear(anchors, views, middle)) return mayTremble ? "same" : "aside";
  return areNear(seen, views, middle) ? "aside" : "none"; // slow drift stays near the last frame but leaves the anchors
}
