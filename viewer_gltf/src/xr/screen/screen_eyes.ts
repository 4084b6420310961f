/**
 * The cameras of two eyes in front of a screen. Both look through it at the same plane, which has
 * no parallax.
 */
import { Matrix4, PerspectiveCamera, Vector3, Vector4 } from "three";

/**
 * Metres. At this distance, that of the opening view, the cameras are as far apart as the user's
 * pupils.
 */
const OPENING_M = 1.8;

export class ScreenEyes {
  /** The left eye first; each camera with its viewport in the render target, pixels. */
  readonly pairs: readonly (readonly [PerspectiveCamera, Vector4])[] = [0, 1].map(() => {
    const camera = new PerspectiveCamera();
    camera.matrixAutoUpdate = false;
    return [camera, new Vector4()] as const;
  });
  private readonly place = new Vector3();
  private readonly aside = new Matrix4();

  /**
   * Places the two cameras. Their distance shrinks with the distance to the focus, so that depth
   * looks alike at any distance.
   *
   * @param camera midway between the eyes
   * @param focus a point of the plane that has no parallax
   * @param pupils_m distance between the user's pupils, metres
   * @param size of one eye's image, pixels; the right eye's lies to the right of the left eye's
   */
  sync(
    camera: PerspectiveCamera,
    focus: Vector3,
    pupils_m: number,
    [width, height]: readonly [number, number],
  ): void {
    const distance_m = -this.place.copy(focus).applyMatrix4(camera.matrixWorldInverse).z;
    const half_m = (pupils_m * distance_m) / OPENING_M / 2;
    this.pairs.forEach(([eye, viewport], i) => {
      const x_m = i === 0 ? -half_m : half_m;
      viewport.set(i * width, 0, width, height);
      eye.matrixWorld.multiplyMatrices(camera.matrixWorld, this.aside.makeTranslation(x_m, 0, 0));
      eye.projectionMatrix.copy(camera.projectionMatrix);
      const { elements } = eye.projectionMatrix;
      // This shift makes both eyes' frusta end at the screen's sides.
      elements[8] -= (elements[0] * x_m) / distance_m;
    });
  }
}
