/**
 * The frame from before a jump of the specimen, which fades into the frame after it. In stereo the
 * specimen jumps and fades, so that nothing moves in front of the eyes unless a head or a hand
 * moves it.
 */
import { MathUtils, type WebGLRenderer, type WebGLRenderTarget } from "three";
import { drawWhole, nothing } from "../gpu/float_targets";
import { linearTarget } from "../gpu/linear_target";
import { ScreenPass } from "../gpu/screen_pass";
import { KEEP_FRAGMENT } from "../gpu/shaders/sources";

const FADE_S = 0.25;

export class CrossFade {
  /** The frame from before the jump, in linear light. */
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

  /** Starts a fade from the last frame to the next one. */
  begin(): void {
    this.isAskedFor = true;
  }

  advance(dt_s: number): void {
    this.left_s = Math.max(0, this.left_s - dt_s);
    if (this.left_s === 0) this.kept.setSize(1, 1); // frees its memory: it is as large as the frame
  }

  /** Stores the last frame if a fade was started. Call it before the next frame is drawn. */
  keep(last: WebGLRenderTarget | null): void {
    const isWanted = this.isAskedFor && last !== null;
    this.isAskedFor = false;
    if (!isWanted) return;
    this.pass.uniforms.uLight.value = last.texture;
    drawWhole(this.renderer, this.pass.scene, this.kept, last.width, last.height);
    this.left_s = FADE_S;
  }

  /** Share of the earlier frame in this one, 0 to 1; 0 if its size differs. */
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
