/**
 * Measures the mean brightness and colour of the traced light in a small traced frame of the view. The ray-marched frame
 * that stands in while the view moves is scaled to that mean, so that both frames look alike.
 */
import { FloatType, type Texture, type WebGLRenderer, type WebGLRenderTarget } from "three";
import type { Eyes } from "../gpu/eyes";
import { drawWhole, floatTarget, nothing } from "../gpu/float_targets";
import { ScreenPass } from "../gpu/screen_pass";
import { TRACE_PROBE } from "./shaders/sources";

/** Number of pixels of the small frame, both eyes together. */
const PIXELS = 600;
/**
 * Number of samples of each pixel of the small frame that are taken at once after the light or the
 * medium has changed.
 */
const FIRST_SAMPLES = 8;
/** Factor to the earlier sums at each further sample, so that about FIRST_SAMPLES samples count. */
const KEPT = 1 - 1 / FIRST_SAMPLES;

/** Sums of light and coverage, one texel for each kind of frame. */
export type ProbedLight = Readonly<{ traced: Texture; marched: Texture }>;

/** Draws one sample of every pixel; `scale` is the resolution relative to the frame buffer. */
export type DrawSample = (target: WebGLRenderTarget, scale: number) => void;

export class LightProbe {
  private readonly sums = floatTarget(2, FloatType);
  private readonly found = [floatTarget(2, FloatType), floatTarget(2, FloatType)];
  private measured = 0;
  private readonly pass = new ScreenPass(TRACE_PROBE, {
    uSums: nothing(),
    uMoments: nothing(),
    uMarched: nothing(),
    uTracedBefore: nothing(),
    uMarchedBefore: nothing(),
    uKept: { value: 0 },
    uOcclusion: { value: 0 },
  });

  /** Drops the measurement, because the light has changed. */
  forget(): void {
    this.measured = 0;
  }

  get light(): ProbedLight {
    const [traced, marched] = this.found[this.measured % 2].textures;
    return { traced, marched };
  }

  /**
   * @param marched the ray-marched frame of the same view, linear and premultiplied
   * @param occlusion how strongly enclosed places are darkened
   */
  measure(
    renderer: WebGLRenderer,
    { width_px, height_px }: Eyes,
    marched: Texture,
    occlusion: number,
    draw: DrawSample,
  ): void {
    const { uniforms, scene } = this.pass;
    if (uniforms.uOcclusion.value !== occlusion) this.forget();
    const scale = Math.min(1, Math.sqrt(PIXELS / (width_px * height_px)));
    uniforms.uMarched.value = marched;
    uniforms.uOcclusion.value = occlusion;
    for (let i = this.measured === 0 ? FIRST_SAMPLES : 1; i > 0; i--) {
      draw(this.sums, scale);
      [uniforms.uSums.value, uniforms.uMoments.value] = this.sums.textures;
      const { traced, marched: before } = this.light;
      uniforms.uTracedBefore.value = traced;
      uniforms.uMarchedBefore.value = before;
      uniforms.uKept.value = this.measured === 0 ? 0 : KEPT;
      this.measured++;
      drawWhole(renderer, scene, this.found[this.measured % 2], 1, 1);
    }
  }

  dispose(): void {
    for (const target of [this.sums, ...this.found]) target.dispose();
    this.pass.dispose();
  }
}
