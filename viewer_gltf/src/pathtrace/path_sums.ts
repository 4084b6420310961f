/** The light that paths have brought to each pixel so far, as sums in float textures, and the pass that adds to it. */
import { FloatType, type WebGLRenderer, type WebGLRenderTarget } from "three";
import type { Eyes } from "../gpu/eyes";
import { floatTarget } from "../gpu/float_targets";
import { drawEyes } from "../gpu/offscreen_target";
import type { ScreenPass } from "../gpu/screen_pass";
import { ENOUGH_SAMPLES } from "../state/path_trace_settings";
import type { History, TraceView } from "./eye_rays";
import { TileNoise } from "./tile_noise";
import type { TraceUniforms } from "./uniforms";

/** Samples between two looks at the noise of the tiles. */
const NOISE_EVERY = 8;

/** Where paths are seen from, and where they begin: eyes that only tremble see those from where the eyes were. */
export type PathViews = Readonly<{
  eyes: Eyes;
  views: readonly TraceView[];
  begins: readonly TraceView[];
  /** Where the paths that were gathered before begin. */
  anchors: readonly TraceView[];
  /** How much the sums before are worth to these paths. */
  history: History;
}>;

export class PathSums {
  private readonly sums = [floatTarget(2, FloatType), floatTarget(2, FloatType)];
  private readonly noise = new TileNoise();
  /** Pictures of paths so far: their sums are drawn alternately into two targets. */
  private drawn = 0;
  /** The number that seeds the random numbers of a pass. */
  private sample = 0;
  /** Samples of a pixel since the picture began; tiles that rest have fewer. */
  samples = 0;
  /** The samples among them whose paths are from the present view. */
  rested = 0;
  /** Where among the tiles the next turn begins, 0..1. */
  private turn = 0;

  /** @param calm standard error of the luminance at which a tile rests more often; 0: none does */
  constructor(
    private readonly pass: ScreenPass<TraceUniforms>,
    private readonly calm: number,
  ) {}

  /** Sums of colour and coverage, and of squared luminance, samples, distance and openness. */
  get gathered(): WebGLRenderTarget {
    return this.sums[this.drawn % 2];
  }

  /** Begin a picture of another view. */
  begin(): void {
    this.samples = this.rested = this.turn = 0;
  }

  /** Keep at most so many samples of a view a little aside. */
  keepAside(most: number): void {
    this.samples = Math.min(this.samples, most);
    this.rested = 0;
  }

  /**
   * Gather so many more samples of every pixel, or of a share of them, up to those that are enough.
   *
   * @param passes samples; below 1 the share of the pixels that get one
   * @param scale pixels of the picture to one of the frame buffer
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

  /** Draw paths into a target, which may be one of another purpose. */
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
