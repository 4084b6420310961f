/** Two eyes before a screen: both look through it at the same plane, which has no parallax. */
import { Matrix4, PerspectiveCamera, Vector3, Vector4 } from "three";

/** Distance, m, at which the eyes are as far apart as the user's pupils: that of the opening view. */
const OPENING_M = 1.8;

export class ScreenEyes {
  /** The left eye first, each with its part of the target, pixels. */
  readonly pairs: readonly (readonly [PerspectiveCamera, Vector4])[] = [0, 1].map(() => {
    const camera = new PerspectiveCamera();
    camera.matrixAutoUpdate = false;
    return [camera, new Vector4()] as const;
  });
  private readonly place = new Vector3();
  private readonly aside = new Matrix4();

  /**
   * Nearer to what is looked at, the eyes come together: so depth looks alike at any distance.
   *
   * @param camera between the eyes
   * @param focus a point of the plane that has no parallax
   * @param pupils_m distance of the user's pupils
   * @param size of one eye's picture, pixels; the right eye's lies right of the left one's
   */
  follow(
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
      elements[8] -= (elements[0] * x_m) / distance_m; // an eye's frustum ends at the screen's sides
    });
  }
}
