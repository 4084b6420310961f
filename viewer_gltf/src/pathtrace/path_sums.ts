/** Sums of the light that paths have brought to each pixel, in float textures, and the pass that adds to them. */
import { FloatType, type WebGLRenderer, type WebGLRenderTarget } from "three";
import type { Eyes } from "../gpu/eyes";
import { floatTarget } from "../gpu/float_targets";
import { drawEyes } from "../gpu/offscreen_target";
import type { ScreenPass } from "../gpu/screen_pass";
import { ENOUGH_SAMPLES } from "../state/path_trace_settings";
import type { History, TraceView } from "./eye_rays";
import { TileNoise } from "./tile_noise";
import type { TraceUniforms } from "./uniforms";

/** Number of samples between two measurements of the tiles' noise. */
const NOISE_EVERY = 8;

/** The views from which paths are seen, and from which they begin. Both differ while eyes tremble. */
export type PathViews = Readonly<{
  eyes: Eyes;
  views: readonly TraceView[];
  begins: readonly TraceView[];
  /** The views from which the earlier paths begin. */
  anchors: readonly TraceView[];
  /** The use of earlier samples: see `History`. */
  history: History;
}>;

export class PathSums {
  private readonly sums = [floatTarget(2, FloatType), floatTarget(2, FloatType)];
  private readonly noise = new TileNoise();
  /** Number of passes so far; the sums are drawn alternately into two targets. */
  private drawn = 0;
  /** The number that seeds the random numbers of a pass. */
  private sample = 0;
  /** Number of samples of a pixel since the frame began. Tiles that are sampled less often have fewer. */
  samples = 0;
  /**
   * Number of samples of a pixel whose paths belong to the current view. The others come from an
   * earlier view.
   */
  rested = 0;
  /** Position among the tiles from which the next pass samples, 0..1. */
  private turn = 0;

  /** @param calm standard error of the luminance below which a tile is sampled less often; 0: all tiles always are */
  constructor(
    private readonly pass: ScreenPass<TraceUniforms>,
    private readonly calm: number,
  ) {}

  /** Sums of colour and coverage, and of squared luminance, samples, distance and openness. */
  get gathered(): WebGLRenderTarget {
    return this.sums[this.drawn % 2];
  }

  /** Starts to sum up samples of another view. Earlier samples no longer count. */
  begin(): void {
    this.samples = this.rested = this.turn = 0;
  }

  /** Keeps a limited number of samples when the view has moved a little. */
  keepAside(most: number): void {
    this.samples = Math.min(this.samples, most);
    this.rested = 0;
  }

  /**
   * Gathers more samples of every pixel, or of a share of the pixels, up to `ENOUGH_SAMPLES`.
   *
   * @param passes number of samples; below 1, the share of the pixels that get one sample
   * @param scale resolution relative to the frame buffer, 0..1
   */
  gather(renderer: WebGLRenderer, views: PathViews, passes: number, scale: number): void {
    const share = Math.min(1, passes);
    let from = views;
    for (let i = 0; i < Math.max(1, Math.floor(passes)); i++) {
      if (this.samples >= ENOUGH_SAMPLES) break;
      this.pass.uniforms.uTurn.value.set(this.turn, share);
      this.add(renderer, from, scale);
      from = { ...views, anchors: views.begins, history: "same" };
      const before = this.samples;
      this.samples = Math.round(1e6 * (before + share)) / 1e6;
      this.rested += share;
      this.turn = (this.turn + share) % 1;
      const isDue = Math.floor(before / NOISE_EVERY) < Math.floor(this.samples / NOISE_EVERY);
      if (isDue) this.noise.measure(renderer, this.gathered);
    }
  }

  private add(renderer: WebGLRenderer, views: PathViews, scale: number): void {
    const { uniforms } = this.pass;
    const before = this.gathered;
    uniforms.uSums.value = before.textures[0];
    uniforms.uMoments.value = before.textures[1];
    uniforms.uNoisiness.value = this.noise.texture;
    uniforms.uCalm.value = this.samples > NOISE_EVERY ? this.calm : 0;
    this.drawn++;
    this.draw(renderer, views, this.gathered, scale);
  }

  /** Draws paths into a target, which may also be the target of another user, such as LightProbe. */
  draw(
    renderer: WebGLRenderer,
    { eyes, views, begins, anchors, history }: PathViews,
    target: WebGLRenderTarget,
    scale: number,
  ): void {
    const { uniforms, uPart, scene } = this.pass;
    uniforms.uSample.value = ++this.sample;
    uniforms.uHistory.value = { none: 0, same: 1, aside: 2 }[history];
    let k = 0;
    drawEyes(renderer, scene, eyes, target, scale, ({ viewport }, part) => {
      uPart.value.copy(part);
      uniforms.uEye.value.copy(viewport);
      uniforms.uSceneToBox.value.copy(views[k].toBox);
      uniforms.uToBox.value.copy(begins[k].toBox);
      uniforms.uEyeAt.value.copy(begins[k].eye);
      if (history === "aside") {
        uniforms.uToBefore.value.copy(anchors[k].fromBox);
        uniforms.uEyeBefore.value.copy(anchors[k].eye);
      }
      k++;
    });
  }

  dispose(): void {
    for (const target of this.sums) target.dispose();
    this.noise.dispose();
  }
}
