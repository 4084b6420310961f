/** The periphery of an eye that looks through a lens: marched at fewer pixels, then filled. */
import type { Vector4, WebGLRenderer, WebGLRenderTarget } from "three";
import type { Eye, Eyes } from "./eyes";
import { nothing } from "./float_targets";
import { linearTarget, withTextures } from "./linear_target";
import { drawEyes } from "./offscreen_target";
import { ScreenPass } from "./screen_pass";
import { FILL_FRAGMENT } from "./shaders/sources";

/**
 * Sets the uniform of `chunks/periphery` for an eye.
 * @param isWorn whether the eye looks through a lens
 */
export function aimLens({ camera }: Eye, isWorn: boolean, uLens: Vector4): void {
  const { elements: p } = camera.projectionMatrix;
  const [x, y] = isWorn ? [1 / p[0], 1 / p[5]] : [0, 0];
  uLens.set(x, y, x * p[8], y * p[9]);
}

export class FilledPeriphery {
  target: WebGLRenderTarget;
  private readonly pass;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly uLens: { value: Vector4 },
  ) {
    this.target = linearTarget(renderer);
    this.pass = new ScreenPass(FILL_FRAGMENT, { uFirst: nothing(), uSecond: nothing(), uLens });
  }

  /**
   * Fills the skipped pixels in the textures of the march. Along an edge, the march has `scale`
   * pixels for each pixel of the frame buffer.
   */
  render({ textures }: WebGLRenderTarget, eyes: Eyes, scale: number): void {
    const { renderer, pass } = this;
    const { uFirst, uSecond } = pass.uniforms;
    [uFirst.value, uSecond.value = null] = textures;
    this.target = withTextures(renderer, this.target, textures.length);
    drawEyes(renderer, pass.scene, eyes, this.target, scale, (eye, part) => {
      pass.uPart.value.copy(part);
      aimLens(eye, true, this.uLens.value);
    });
  }

  dispose(): void {
    this.target.dispose();
    this.pass.dispose();
  }
}
