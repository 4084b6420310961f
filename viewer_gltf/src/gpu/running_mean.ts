/** The running mean of images, which removes differences between them, such as noise. */
import {
  AddEquation,
  ConstantAlphaFactor,
  CustomBlending,
  OneMinusConstantAlphaFactor,
  type Texture,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import { drawWhole, nothing } from "./float_targets";
import { linearTarget, withTextures } from "./linear_target";
import { ScreenPass } from "./screen_pass";
import { COPY_FRAGMENT } from "./shaders/sources";

export class RunningMean {
  count = 0;
  target: WebGLRenderTarget;
  private readonly pass = new ScreenPass(COPY_FRAGMENT, { uFirst: nothing(), uSecond: nothing() });

  constructor(private readonly renderer: WebGLRenderer) {
    this.target = linearTarget(renderer);
    Object.assign(this.pass.material, {
      blending: CustomBlending,
      blendEquation: AddEquation,
      blendSrc: ConstantAlphaFactor,
      blendDst: OneMinusConstantAlphaFactor,
      transparent: true,
    });
  }

  get textures(): readonly Texture[] {
    return this.target.textures;
  }

  add({ textures, width, height }: WebGLRenderTarget): void {
    const { uFirst, uSecond } = this.pass.uniforms;
    [uFirst.value, uSecond.value = null] = textures;
    const before = this.target;
    this.target = withTextures(this.renderer, before, textures.length);
    if (this.target !== before) this.count = 0;
    if (this.target.width !== width || this.target.height !== height) this.count = 0;
    this.count++;
    this.pass.material.blendAlpha = 1 / this.count;
    const { autoClear } = this.renderer;
    this.renderer.autoClear = false;
    drawWhole(this.renderer, this.pass.scene, this.target, width, height);
    this.renderer.autoClear = autoClear;
  }

  dispose(): void {
    this.target.dispose();
    this.pass.dispose();
  }
}
