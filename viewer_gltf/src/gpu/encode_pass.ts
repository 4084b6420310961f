/** Encodes linear light for the screen, once, after everything is blended. */
import { Camera, type Texture, Vector4, type WebGLRenderer, type WebGLRenderTarget } from "three";
import { nothing } from "./float_targets";
import { ScreenPass } from "./screen_pass";
import { ENCODE_FRAGMENT } from "./shaders/sources";

const ANY_CAMERA = new Camera();

export class EncodePass {
  private readonly pass = new ScreenPass(ENCODE_FRAGMENT, {
    uLight: nothing(),
    uBefore: nothing(),
    uShareBefore: { value: 0 },
  });
  private readonly viewport = new Vector4();

  /** Whether the background shows through where the frame is empty. */
  set isSeeThrough(is: boolean) {
    this.pass.define("SEE_THROUGH", is ? 1 : null);
  }

  /** Mixes a share, 0 to 1, of an earlier frame into the next ones. */
  mix(before: Texture, share: number): void {
    const { uBefore, uShareBefore } = this.pass.uniforms;
    uBefore.value = share > 0 ? before : null;
    uShareBefore.value = share;
  }

  /** Covers a target of the same size as the light; null: the canvas. */
  render(
    renderer: WebGLRenderer,
    light: WebGLRenderTarget,
    target: WebGLRenderTarget | null,
  ): void {
    const { enabled } = renderer.xr; // otherwise three.js would draw for each of the headset's eyes
    renderer.xr.enabled = false;
    this.pass.uniforms.uLight.value = light.texture;
    if (target !== null) {
      // a headset's frame buffer may be larger than three.js reports
      this.viewport.copy(target.viewport);
      target.viewport.set(0, 0, light.width, light.height);
    }
    renderer.setRenderTarget(target);
    renderer.render(this.pass.scene, ANY_CAMERA);
    target?.viewport.copy(this.viewport);
    renderer.xr.enabled = enabled;
  }

  dispose(): void {
    this.pass.dispose();
  }
}
