/** How noisy each tile of a gathered picture is: noisy ones take more samples. */
import { FloatType, type Texture, type WebGLRenderer, type WebGLRenderTarget } from "three";
import { drawWhole, floatTarget } from "../gpu/float_targets";
import { ScreenPass } from "../gpu/screen_pass";
import { TRACE_NOISE } from "./shaders/sources";
import { sumUniforms } from "./uniforms";

/** Pixels along the edge of a tile that rests or is sampled as a whole. */
export const NOISE_TILE = 16;

export class TileNoise {
  private readonly target = floatTarget(1, FloatType);
  private readonly pass = new ScreenPass(TRACE_NOISE, sumUniforms(), { NOISE_TILE });

  /** The standard error of the mean luminance, a texel for each tile. */
  get texture(): Texture {
    return this.target.texture;
  }

  /** @param sums as path_trace.frag.glsl writes them */
  judge(renderer: WebGLRenderer, sums: WebGLRenderTarget): void {
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
