/** Measures the noise of each tile of a traced frame, so that noisy tiles get more samples. */
import { FloatType, type Texture, type WebGLRenderer, type WebGLRenderTarget } from "three";
import { drawWhole, floatTarget } from "../gpu/float_targets";
import { ScreenPass } from "../gpu/screen_pass";
import { TRACE_NOISE } from "./shaders/sources";
import { sumUniforms } from "./uniforms";

/** Edge of a tile, pixels. A tile is either sampled as a whole or skipped. */
export const NOISE_TILE = 16;

export class TileNoise {
  private readonly target = floatTarget(1, FloatType);
  private readonly pass = new ScreenPass(TRACE_NOISE, sumUniforms(), { NOISE_TILE });

  /** Standard error of the mean luminance, one texel for each tile. */
  get texture(): Texture {
    return this.target.texture;
  }

  /** @param sums the textures that path_trace.frag.glsl writes */
  measure(renderer: WebGLRenderer, sums: WebGLRenderTarget): void {
    const { uniforms, scene } = this.pass;
    [uniforms.uSums.value, uniforms.uMoments.value] = sums.textures;
    const [columns, rows] = [sums.width, sums.height].map((n) => Math.ceil(n / NOISE_TILE));
    drawWhole(renderer, scene, this.target, columns, rows);
  }

  dispose(): void {
    this.target.dispose();
    this.pass.dispose();
  }
}
