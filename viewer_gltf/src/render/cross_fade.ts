/**
 * The picture from before a jump of the specimen, which fades into the picture after it. In stereo nothing
 * moves before the eyes that neither a head nor a hand has moved.
 */
import { MathUtils, type WebGLRenderer, type WebGLRenderTarget } from "three";
import { drawWhole, nothing } from "../gpu/float_targets";
import { linearTarget } from "../gpu/linear_target";
import { ScreenPass } from "../gpu/screen_pass";
import { KEEP_FRAGMENT } from "../gpu/shaders/sources";

/** Length of a fade, s. */
const FADE_S = 0.25;

export class CrossFade {
  /** Linear light of the picture from before the jump. */
  private readonly kept: WebGLRenderTarget;
  private readonly pass = new ScreenPass(KEEP_FRAGMENT, { uLight: nothing() });
  private isAskedFor = false;
  private left_s = 0;

  constructor(private readonly renderer: WebGLRenderer) {
    this.kept = linearTarget(renderer);
  }

  get texture() {
    return this.kept.texture;
  }

  /** Fade from the last picture to the next one. */
  begin(): void {
    this.isAskedFor = true;
  }

  /** Go on with a fade. */
  advance(dt_s: number): void {
    this.left_s = Math.max(0, this.left_s - dt_s);
    if (this.left_s === 0) this.kept.setSize(1, 1); // it is as large as the picture
  }

  /** Keep the last picture, if a fade was asked for. To be called before the next one is drawn. */
  keep(last: WebGLRenderTarget | null): void {
    const isWanted = this.isAskedFor && last !== null;
    this.isAskedFor = false;
    if (!isWanted) return;
    this.pass.uniforms.uLight.value = last.texture;
    drawWhole(this.renderer, this.pass.scene, this.kept, last.width, last.height);
    this.left_s = FADE_S;
  }

  /** Share of the picture from before, 0..1. A picture of another size is no picture from before. */
  shareIn({ width, height }: WebGLRenderTarget): number {
    const { kept } = this;
    if (kept.width !== width || kept.height !== height) return 0;
    return MathUtils.smoothstep(this.left_s, 0, FADE_S);
  }

  dispose(): void {
    this.kept.dispose();
    this.pass.dispose();
  }
}
