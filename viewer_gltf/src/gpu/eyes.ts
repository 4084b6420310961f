/**
 * The eyes of a frame: one on a flat screen, two in a headset or in a Cardboard viewer. Passes that
 * draw into textures loop over the eyes, because three.js draws all eyes of a headset only into the
 * headset's own frame buffer.
 */
import { PerspectiveCamera, Vector4, type WebGLRenderer } from "three";

export type Eye = Readonly<{
  /** Camera of the eye. The caller sets the camera's matrices once for each frame. */
  camera: PerspectiveCamera;
  /** x, y, width, height in pixels of the frame buffer, from its lower left corner. */
  viewport: Vector4;
}>;

export class Eyes {
  private readonly pool: Eye[] = [];
  private count = 0;
  /** Size of the frame buffer, pixels. */
  width_px = 1;
  height_px = 1;

  get all(): readonly Eye[] {
    return this.pool.slice(0, this.count);
  }

  /** Uses one eye that sees the whole canvas. */
  followScreen(renderer: WebGLRenderer, camera: PerspectiveCamera): void {
    const gl = renderer.getContext();
    this.count = 0;
    this.width_px = gl.drawingBufferWidth;
    this.height_px = gl.drawingBufferHeight;
    this.add(camera).viewport.set(0, 0, this.width_px, this.height_px);
  }

  /**
   * Uses the eyes of the running session; `camera` is the one that three.js moves with the head.
   */
  followHeadset(renderer: WebGLRenderer, camera: PerspectiveCamera): void {
    renderer.xr.updateCamera(camera);
    this.sync(renderer.xr.getCamera().cameras.map((each) => [each, each.viewport]));
  }

  sync(eyes: readonly (readonly [PerspectiveCamera, Vector4 | undefined])[]): void {
    this.count = 0;
    this.width_px = 1;
    this.height_px = 1;
    for (const [camera, viewport] of eyes) {
      if (viewport === undefined) continue;
      this.add(camera).viewport.copy(viewport);
      // The frame buffer is as large as the eyes' viewports reach, independent of the canvas.
      this.width_px = Math.max(this.width_px, viewport.x + viewport.z);
      this.height_px = Math.max(this.height_px, viewport.y + viewport.w);
    }
  }

  private add(camera: PerspectiveCamera): Eye {
    let eye = this.pool[this.count];
    if (eye === undefined) {
      eye = { camera: new PerspectiveCamera(), viewport: new Vector4() };
      eye.camera.viewport = eye.viewport;
      eye.camera.matrixAutoUpdate = false;
      eye.camera.matrixWorldAutoUpdate = false;
      this.pool.push(eye);
    }
    this.count++;
    eye.camera.matrixWorld.copy(camera.matrixWorld);
    eye.camera.matrixWorldInverse.copy(camera.matrixWorld).invert();
    eye.camera.projectionMatrix.copy(camera.projectionMatrix);
    eye.camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
    return eye;
  }
}
