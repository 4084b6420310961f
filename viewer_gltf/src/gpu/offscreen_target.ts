/** Draws a scene into a texture, each eye in its part of the texture. */
import {
  type ArrayCamera,
  type Scene,
  Vector4,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import type { Eye, Eyes } from "./eyes";

/**
 * An eye's part, in whole pixels, of a target that is `scale` times as large as the frame buffer.
 */
export function partOf({ viewport }: Eye, scale: number, into = new Vector4()): Vector4 {
  into.copy(viewport).multiplyScalar(scale).round();
  return into.setZ(Math.max(1, into.z)).setW(Math.max(1, into.w));
}

/**
 * Draws each eye with its own camera. `target` is resized to the frame buffer times `scale`, and
 * cleared.
 *
 * @param onEye called before each eye is drawn, with its part of the target
 */
export function drawEyes(
  renderer: WebGLRenderer,
  scene: Scene,
  eyes: Eyes,
  target: WebGLRenderTarget,
  scale: number,
  onEye?: (eye: Eye, part: Vector4) => void,
): void {
  drawInto(renderer, eyes, target, scale, () => {
    for (const eye of eyes.all) {
      partOf(eye, scale, target.viewport);
      renderer.setRenderTarget(target);
      onEye?.(eye, target.viewport);
      renderer.render(scene, eye.camera);
    }
  });
}

/** Draws all eyes at once at the frame buffer's size, with one camera for all. */
export function drawAllEyes(
  renderer: WebGLRenderer,
  scene: Scene,
  eyes: Eyes,
  camera: ArrayCamera,
  target: WebGLRenderTarget,
): void {
  drawInto(renderer, eyes, target, 1, () => renderer.render(scene, camera));
}

function drawInto(
  renderer: WebGLRenderer,
  { width_px, height_px }: Eyes,
  target: WebGLRenderTarget,
  scale: number,
  draw: () => void,
): void {
  const before = renderer.getRenderTarget();
  const { autoClear } = renderer;
  const { enabled } = renderer.xr; // otherwise three.js would draw the headset's eyes itself
  const width = Math.max(1, Math.ceil(width_px * scale));
  const height = Math.max(1, Math.ceil(height_px * scale));
  target.setSize(width, height);
  target.viewport.set(0, 0, width, height);
  renderer.xr.enabled = false;
  renderer.autoClear = false;
  renderer.setRenderTarget(target);
  const clearAlpha = renderer.getClearAlpha();
  renderer.setClearAlpha(0);
  renderer.clear();
  renderer.setClearAlpha(clearAlpha);
  draw();
  renderer.xr.enabled = enabled;
  renderer.autoClear = autoClear;
  renderer.setRenderTarget(before);
}
