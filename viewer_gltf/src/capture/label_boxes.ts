/** Finds the boxes of the scene's labels in an image, so that scale bar, legend and axes can avoid them. */
import { type Object3D, type PerspectiveCamera, Sprite, Vector3 } from "three";

/** A rectangle in pixels, y down. */
export type Rect = Readonly<{ x: number; y: number; width: number; height: number }>;

/** Returns the boxes of all visible labels below `root` in a camera's image. */
export function labelBoxes(
  root: Object3D,
  camera: PerspectiveCamera,
  { width, height }: Readonly<{ width: number; height: number }>,
): readonly Rect[] {
  const found: Rect[] = [];
  const at = new Vector3();
  const size = new Vector3();
  root.updateWorldMatrix(true, true);
  root.traverseVisible((object) => {
    if (!(object instanceof Sprite)) return;
    at.setFromMatrixPosition(object.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
    if (at.z >= 0) return; // behind the eye
    size.setFromMatrixScale(object.matrixWorld).divideScalar(-at.z);
    const { elements } = camera.projectionMatrix;
    const across = (size.x * elements[0] * width) / 2;
    const up = (size.y * elements[5] * height) / 2;
    at.applyMatrix4(camera.projectionMatrix);
    const left = ((at.x + 1) / 2) * width - object.center.x * across;
    const bottom = ((1 - at.y) / 2) * height + object.center.y * up;
    found.push({ x: left, y: bottom - up, width: across, height: up });
  });
  return found;
}

/** Returns the area that a rectangle shares with others. */
function shared(rect: Rect, others: readonly Rect[]): number {
  const within = (a: number, aSize: number, b: number, bSize: number) =>
    Math.max(0, Math.min(a + aSize, b + bSize) - Math.max(a, b));
  return others.reduce(
    (sum, { x, y, width, height }) =>
      sum + within(rect.x, rect.width, x, width) * within(rect.y, rect.height, y, height),
    0,
  );
}

/**
 * Returns the first of some rectangles that overlaps none of the others; if each overlaps some, the
 * one that does so least.
 */
export function clearestOf(places: readonly Rect[], others: readonly Rect[]): Rect {
  return places.reduce((best, place) =>
    shared(place, others) < shared(best, others) ? place : best,
  );
}

export type Corner = "top-left" | "top-right" | "bottom-left" | "bottom-right";

/**
 * Returns the rectangles that an element of the caption would take in the given corners of an
 * image, in this order.
 */
export function inCorners(
  corners: readonly Corner[],
  block: Readonly<{ width: number; height: number }>,
  picture: Readonly<{ width: number; height: number }>,
  edge: number,
): readonly Rect[] {
  return corners.map((corner) => ({
    ...block,
    x: corner.endsWith("left") ? edge : picture.width - edge - block.width,
    y: corner.startsWith("top") ? edge : picture.height - edge - block.height,
  }));
}
