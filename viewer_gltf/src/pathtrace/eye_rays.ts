/** From where paths start: an eye in the space of the box, and how it moved since. Pure. */
import { Matrix3, Matrix4, type PerspectiveCamera, Quaternion, Vector3 } from "three";

export type TraceView = Readonly<{
  /** From normalised device coordinates to um of the box, and back. */
  toBox: Matrix4;
  fromBox: Matrix4;
  eye: Vector3;
}>;

/** @param box from um of the box to the room */
export function viewOf(camera: PerspectiveCamera, box: Matrix4): TraceView {
  const fromBox = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).multiply(box);
  const eye = new Vector3()
    .setFromMatrixPosition(camera.matrixWorld)
    .applyMatrix4(box.clone().invert());
  return { toBox: fromBox.clone().invert(), fromBox, eye };
}

/** The turn of a matrix, without its scale. */
export function turnOf(matrix: Matrix4): Matrix3 {
  const turn = new Quaternion();
  matrix.decompose(new Vector3(), turn, new Vector3());
  return new Matrix3().setFromMatrix4(new Matrix4().makeRotationFromQuaternion(turn));
}

/**
 * What earlier frames are worth to paths that begin here: nothing; all; as far as they show the same
 * from aside.
 */
export type History = "none" | "same" | "aside";

export function areSame(a: readonly TraceView[], b: readonly TraceView[]): boolean {
  return a.length === b.length && a.every(({ fromBox }, k) => fromBox.equals(b[k].fromBox));
}

/** Largest tremble of a head at rest, degrees. */
const TREMBLE_DEG = 0.3;
/** Largest move of a head at rest, as a share of the distance to the box's middle. */
const TREMBLE_SHARE = 0.006;

/** Whether eyes have moved by no more than a head that rests. */
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

/** Where the eyes were while earlier frames were gathered. */
export type ViewsBefore = Readonly<{
  /** From where the gathered paths begin. */
  anchors: readonly TraceView[];
  /** Where the eyes were in the frame before; none: that frame gathered too little. */
  seen: readonly TraceView[];
  /** The middle of the box, um. */
  middle: Vector3;
  /** Whether paths may begin where the eyes were, as long as they only tremble. */
  mayTremble: boolean;
}>;

/** Returns how much earlier frames are worth to paths from the present views. */
export function historyOf(
  views: readonly TraceView[],
  { anchors, seen, middle, mayTremble }: ViewsBefore,
): History {
  if (anchors.length !== views.length) return "none";
  if (areSame(anchors, views)) return "same";
  if (areNear(anchors, views, middle)) return mayTremble ? "same" : "aside";
  return areNear(seen, views, middle) ? "aside" : "none"; // eyes also sway, slowly
}
