/** Draw a scene into a texture, for each eye in its part of it. */
import type { Scene, WebGLRenderer, WebGLRenderTarget } from "three";
import type { Eye, Eyes } from "./eyes";

/**
 * `target` becomes as large as the frame buffer times `scale`, and is cleared.
 *
 * @param onEye called before each eye is drawn, with the corner of its part in pixels of the target
 */
export function drawEyes(
  renderer: WebGLRenderer,
  scene: Scene,
  eyes: Eyes,
  target: WebGLRenderTarget,
  scale: number,
  onEye?: (eye: Eye, x_px: number, y_px: number) => void,
): void {
  const before = renderer.getRenderTarget();
  const { autoClear } = renderer;
  const { enabled } = renderer.xr; // else three would draw the headset's eyes by itself
  const width = Math.max(1, Math.ceil(eyes.width_px * scale));
  const height = Math.max(1, Math.ceil(eyes.height_px * scale));
  target.setSize(width, height);
  target.viewport.set(0, 0, width, height);
  renderer.xr.enabled = false;
  renderer.autoClear = false;
  renderer.setRenderTarget(target);
  const clearAlpha = renderer.getClearAlpha();
  renderer.setClearAlpha(0);
  renderer.clear();
  renderer.setClearAlpha(clearAlpha);
  for (const eye of eyes.all) {
    const { x, y, z, w } = eye.viewport;
    target.viewport.set(x * scale, y * scale, z * scale, w * scale);
    renderer.setRenderTarget(target);
    onEye?.(eye, x * scale, y * scale);
    renderer.render(scene, eye.camera);
  }
  renderer.xr.enabled = enabled;
  renderer.autoClear = autoClear;
  renderer.setRenderTarget(before);
}
