/**
 * The cameras of the two eyes, one for each half of the render target, and one camera around both
 * for culling.
 */
import { ArrayCamera, type Matrix4, PerspectiveCamera, Vector4 } from "three";
import { eyeTangents, type Screen, type Side, type Tangents } from "./lens";
import type { Profile } from "./viewer_profile";

const NEAR_M = 0.05;
const FAR_M = 20;

/** `viewport` in pixels of the target. */
export type Eye = Readonly<{ side: Side; camera: PerspectiveCamera; viewport: Vector4 }>;

export class EyeCameras {
  readonly eyes: readonly Eye[];
  readonly both: ArrayCamera;
  private apart_m = 0;
  /**
   * Distance from the eyes back to the apex of the frustum that encloses both eyes' frusta, metres.
   */
  private behind_m = 0;

  constructor() {
    this.eyes = (["left", "right"] as const).map((side) => {
      const viewport = new Vector4();
      const camera = new PerspectiveCamera();
      camera.matrixAutoUpdate = false;
      camera.viewport = viewport;
      return { side, camera, viewport };
    });
    this.both = new ArrayCamera(this.eyes.map(({ camera }) => camera));
    this.both.matrixAutoUpdate = false;
  }

  /**
   * @param width of the render target, in pixels; each eye has half of it
   * @param apart_m distance between the two cameras, metres
   */
  fit(
    profile: Profile,
    screen: Screen,
    width: number,
    height: number,
    apart_m = profile.interLens_m,
  ): void {
    const half = Math.floor(width / 2);
    const [left, right] = this.eyes.map(({ side, camera, viewport }, i) => {
      const tangents = eyeTangents(profile, screen, side);
      viewport.set(i * half, 0, half, height);
      project(camera, NEAR_M, FAR_M, tangents);
      return tangents;
    });
    this.apart_m = apart_m;
    this.behind_m = this.apart_m / (left.left + right.right);
    const outer = { ...left, right: right.right };
    project(this.both, NEAR_M + this.behind_m, FAR_M + this.behind_m, outer);
  }

  /** @param head pose of the point between the eyes, metres */
  follow(head: Matrix4): void {
    for (const { side, camera } of this.eyes) {
      place(camera, head, ((side === "left" ? -1 : 1) * this.apart_m) / 2, 0);
    }
    place(this.both, head, 0, this.behind_m);
  }
}

/** Places a camera at the head's pose, moved along the head's own x and z. */
function place(camera: PerspectiveCamera, head: Matrix4, x_m: number, z_m: number): void {
  camera.matrix.makeTranslation(x_m, 0, z_m).premultiply(head);
  camera.matrix.decompose(camera.position, camera.quaternion, camera.scale);
  camera.updateMatrixWorld(true);
}

/** Sets an asymmetric frustum from the tangents of its four sides. */
function project(camera: PerspectiveCamera, near_m: number, far_m: number, sides: Tangents): void {
  camera.near = near_m;
  camera.far = far_m;
  const [left, right] = [-sides.left * near_m, sides.right * near_m];
  const [bottom, top] = [-sides.bottom * near_m, sides.top * near_m];
  camera.projectionMatrix.makePerspective(left, right, top, bottom, near_m, far_m);
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
}
