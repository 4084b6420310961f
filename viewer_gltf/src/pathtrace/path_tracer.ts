/**
 * Gathers light along paths, frame by frame, in float textures: for every pixel the sum of what its
 * paths brought. A view that stays gathers on, one that trembles carries it along, a new one begins
 * anew.
 */
import {
  FloatType,
  Matrix4,
  type Texture,
  type Vector3,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import { SKIP_BRICK, STREAM_BRICK } from "../bundle/generated/constants";
import type { Eyes } from "../gpu/eyes";
import { floatTarget } from "../gpu/float_targets";
import { drawEyes } from "../gpu/offscreen_target";
import { GROUND, SKY } from "../gpu/room_light";
import { ScreenPass } from "../gpu/screen_pass";
import { ENOUGH_SAMPLES, type TraceSettings } from "../state/path_trace_settings";
import type { MarchLight } from "../volumes/march_frame";
import { DenoiseAndTone, type Marched } from "./denoise_and_tone";
import type { EnvironmentTables } from "./environment_sampling";
import type { MediumAppearance } from "./extinction";
import { areNear, areSame, type History, type TraceView, viewOf } from "./eye_rays";
import { LightProbe } from "./light_probe";
import { type Hemispheres, hemispheresOf, lightMarch } from "./march_light";
import type { MediumTexels } from "./medium_loader";
import { MediumTextures } from "./medium_textures";
import { TRACE_FRAGMENT } from "./shaders/sources";
import { NOISE_TILE, TileNoise } from "./tile_noise";
import {
  keyOf,
  lowCorner,
  matterOf,
  sceneInto,
  type TraceScene,
  type TraceUniforms,
  texelsInto,
  traceUniforms,
} from "./uniforms";

/** Samples between two looks at the noise of the tiles. */
const NOISE_EVERY = 8;
/** Noise at which a tile is as good as done. */
const CALM = 0.004;
/** Most samples that are kept of a view a little aside. */
const MAX_ASIDE = 48;

/** How a frame is gathered. */
export type Gathering = Readonly<{
  /** Pixels of the picture to one of the frame buffer, 0..1. */
  scale: number;
  /** Samples of every pixel, or of a share of them. */
  passes: number;
  /**
   * Eyes that hardly move see what was gathered, from where they are; else paths begin at the very
   * eye.
   */
  mayTremble: boolean;
  /** Paths are shorter: a picture that moves has to be quick. */
  isDraft: boolean;
  /** What stands in for pixels that have few samples of this view; null: nothing can. */
  standIn?: Marched | null;
}>;

/** Samples with which nothing stands in for any pixel: see tone_map.frag.glsl. */
const STOOD_IN = 5;

export class Tracer {
  /** Samples of a pixel since the picture began anew; tiles that rest have fewer. */
  samples = 0;
  /** Those of them with paths from the present view. */
  rested = 0;
  private readonly sums = [floatTarget(2, FloatType), floatTarget(2, FloatType)];
  private readonly noise = new TileNoise();
  private readonly probe = new LightProbe();
  private readonly denoiseAndTone = new DenoiseAndTone(this.probe);
  private roomLight: readonly [number, number, number] = [0, 0, 0];
  private hemispheres: Hemispheres = { sky: SKY, ground: GROUND };
  private texels: MediumTexels | null = null;
  /** From where paths begin: where the eyes were, as long as they only tremble. */
  private anchors: readonly TraceView[] = [];
  /** Where the eyes were in the frame before. */
  private seen: readonly TraceView[] = [];
  /** Pictures of paths so far: their sums are drawn alternately into two targets. */
  private drawn = 0;
  /** The number that seeds the random numbers of a pass. */
  private sample = 0;
  private shownWith: TraceSettings | null = null;
  /** Where among the tiles the next turn begins, 0..1. */
  private turn = 0;
  private key = "";
  private matter = "";
  private gatheredScale = 1;
  private isDraft = false;
  /** Whether a marched picture stands in for pixels with few samples. */
  isStoodIn = false;
  private readonly pathPass: ScreenPass<TraceUniforms>;
  private readonly textures: MediumTextures;

  /**
   * @param brick texels along an edge of a brick of majorants: SKIP_BRICK or a multiple
   * @param calm standard error of the luminance at which a tile rests more often; 0: none does
   */
  constructor(
    sceneDepth: { value: Texture },
    brick = 2 * SKIP_BRICK,
    private readonly calm = CALM,
  ) {
    this.pathPass = new ScreenPass(TRACE_FRAGMENT, traceUniforms(sceneDepth, MAX_ASIDE), {
      CHANNELS: 1,
      NOISE_TILE,
    });
    this.textures = new MediumTextures(this.pathPass, brick);
  }

  /** The picture, encoded and premultiplied. */
  get picture(): WebGLRenderTarget {
    return this.denoiseAndTone.picture;
  }

  /** Pixels of the picture to one of the frame buffer. */
  get scale(): number {
    return this.denoiseAndTone.scale;
  }

  /** Sums of colour and coverage, and of squared luminance, samples, distance and openness. */
  get gathered(): WebGLRenderTarget {
    return this.sums[this.drawn % 2];
  }

  get isReady(): boolean {
    return this.texels !== null;
  }

  /** Drops the samples, because the medium or the light has changed. */
  restart(): void {
    this.probe.forget();
    this.begin();
  }

  /** Begin a picture of another view. */
  private begin(): void {
    this.anchors = [];
    this.samples = this.rested = this.turn = 0;
    this.shownWith = null;
  }

  /** What paths go through; takes over the texture. */
  fill(texels: MediumTexels | null): void {
    if (this.texels !== texels) this.texels?.release();
    this.texels = texels;
    this.restart();
    if (texels === null) return;
    const { uniforms } = this.pathPass;
    texelsInto(uniforms, texels);
    this.pathPass.define("STREAM_BRICK", texels.index === null ? null : STREAM_BRICK);
    this.pathPass.define("CHANNELS", texels.channels.length);
    this.denoiseAndTone.expect(uniforms.uSize.value);
  }

  /** @param appearances of the channels, in the order of the texture's */
  setAppearances(appearances: readonly MediumAppearance[], settings: TraceSettings): void {
    if (this.texels === null) return;
    this.textures.setAppearances(this.texels, appearances, settings.density);
    this.restart();
  }

  /** @param toEye from the specimen's axes to those of the eye */
  lightMarch(march: MarchLight, settings: TraceSettings, toEye: Matrix4): void {
    lightMarch(march, settings, this.hemispheres, toEye);
  }

  lightBy(tables: EnvironmentTables): void {
    this.roomLight = tables.mean;
    this.hemispheres = hemispheresOf(tables);
    this.textures.lightBy(tables);
    this.restart();
  }

  /**
   * Whether what is gathered is worth anything to these eyes.
   *
   * @param mayTremble see `render`
   */
  goesOn(eyes: Eyes, scene: TraceScene, mayTremble: boolean): boolean {
    if (this.texels === null) return false;
    if (keyOf(eyes, scene, this.gatheredScale, this.isDraft) !== this.key) {
      return false;
    }
    const history = this.historyFor(this.viewsOf(eyes, scene), mayTremble);
    return history === "same" || (mayTremble && history === "aside");
  }

  /**
   * Make the picture of the stand-in alone: the view moves, and what was gathered is of another one.
   *
   * @param marched of this view
   */
  standIn(
    renderer: WebGLRenderer,
    eyes: Eyes,
    scene: TraceScene,
    settings: TraceSettings,
    marched: Marched,
  ): void {
    if (this.texels === null) return;
    this.prepare(eyes, scene, settings, this.gatheredScale, false);
    this.begin();
    const views = this.viewsOf(eyes, scene);
    this.probeLight(renderer, eyes, views, settings, marched);
    this.isStoodIn = true;
    this.denoiseAndTone.show(renderer, eyes, views, settings, true, { ...marched, rounds: 0 });
  }

  /**
   * Gather so many more samples of every pixel, or of a share of them, and make the picture, as soon
   * as each pixel has one. A picture with enough of them only follows the eyes.
   */
  render(
    renderer: WebGLRenderer,
    eyes: Eyes,
    scene: TraceScene,
    settings: TraceSettings,
    { scale, passes, mayTremble, isDraft, standIn = null }: Gathering,
  ): void {
    if (this.texels === null) return;
    this.prepare(eyes, scene, settings, scale, isDraft);
    const views = this.viewsOf(eyes, scene);
    let history = this.historyFor(views, mayTremble);
    this.seen = views;
    if (history === "none") this.begin();
    if (history === "aside") {
      this.samples = Math.min(this.samples, MAX_ASIDE);
      this.rested = 0;
    }
    const begins = history === "same" ? this.anchors : views;
    const share = Math.min(1, passes);
    const started = this.samples;
    for (let i = 0; i < Math.max(1, Math.floor(passes)); i++) {
      if (this.samples >= ENOUGH_SAMPLES) break;
      this.pathPass.uniforms.uTurn.value.set(this.turn, share);
      this.gather(renderer, eyes, views, begins, history);
      this.anchors = begins;
      history = "same";
      const before = this.samples;
      this.samples = Math.round(1e6 * (before + share)) / 1e6;
      this.rested += share;
      this.turn = (this.turn + share) % 1;
      const isDue = Math.floor(before / NOISE_EVERY) < Math.floor(this.samples / NOISE_EVERY);
      if (isDue) this.noise.judge(renderer, this.gathered);
    }
    const { denoiseAndTone } = this;
    this.isStoodIn = standIn !== null && this.samples < STOOD_IN;
    // A part of the pixels alone is not shown: until all have their turn, the picture before stays, or
    // the marched one that stands in.
    const isRound = Math.floor(this.samples) > Math.floor(started);
    const isAny = this.isStoodIn || this.samples >= 1;
    const isOther = isAny && (isRound || settings !== this.shownWith);
    if (isOther) {
      const { gathered, samples } = this;
      denoiseAndTone.denoise(renderer, eyes, gathered, samples, begins, scale, settings);
      this.shownWith = settings;
    }
    if (this.isStoodIn && standIn !== null) {
      this.probeLight(renderer, eyes, views, settings, standIn);
    }
    const rounds = Math.floor(this.samples);
    const marched = this.isStoodIn && standIn !== null ? { ...standIn, rounds } : null;
    denoiseAndTone.show(renderer, eyes, views, settings, isOther, marched);
  }

  /** Follow the scene; what was gathered of another one is dropped. */
  private prepare(
    eyes: Eyes,
    scene: TraceScene,
    settings: TraceSettings,
    scale: number,
    isDraft: boolean,
  ): void {
    if (this.texels === null) return;
    const box = this.boxMatrix(scene.specimen);
    const { uniforms } = this.pathPass;
    sceneInto(uniforms, scene, this.texels.frame, box, settings, isDraft, this.roomLight);
    const matter = matterOf(scene);
    if (matter !== this.matter) this.restart();
    this.matter = matter;
    const key = keyOf(eyes, scene, scale, isDraft);
    if (key !== this.key) this.begin();
    this.key = key;
    this.gatheredScale = scale;
    this.isDraft = isDraft;
  }

  /** Find how much light there is, by a few paths, for the stand-in. */
  private probeLight(
    renderer: WebGLRenderer,
    eyes: Eyes,
    views: readonly TraceView[],
    { isPostOn, occlusion }: TraceSettings,
    { picture }: Marched,
  ): void {
    this.probe.measure(renderer, eyes, picture, isPostOn ? occlusion : 0, (target, scale) => {
      const { uniforms } = this.pathPass;
      uniforms.uCalm.value = 0;
      uniforms.uTurn.value.set(0, 1);
      this.drawPaths(renderer, eyes, views, views, "none", target, scale);
    });
  }

  private viewsOf(eyes: Eyes, { specimen }: TraceScene): TraceView[] {
    const box = this.boxMatrix(specimen);
    return eyes.all.map(({ camera }) => viewOf(camera, box));
  }

  /** Of the box, um. */
  private get middle(): Vector3 {
    return this.pathPass.uniforms.uSize.value.clone().multiplyScalar(0.5);
  }

  /** What was gathered is worth to the paths that come. */
  private historyFor(views: readonly TraceView[], mayTremble: boolean): History {
    const { anchors, seen, middle } = this;
    if (anchors.length !== views.length) return "none";
    if (areSame(anchors, views)) return "same";
    if (areNear(anchors, views, middle)) return mayTremble ? "same" : "aside";
    // eyes also sway, slowly
    return this.rested >= 1 && areNear(seen, views, middle) ? "aside" : "none";
  }

  /**
   * @param views where the eyes are
   * @param begins where the paths begin
   */
  private gather(
    renderer: WebGLRenderer,
    eyes: Eyes,
    views: readonly TraceView[],
    begins: readonly TraceView[],
    history: History,
  ): void {
    const { uniforms } = this.pathPass;
    const before = this.gathered;
    uniforms.uSums.value = before.textures[0];
    uniforms.uMoments.value = before.textures[1];
    uniforms.uNoisiness.value = this.noise.texture;
    uniforms.uCalm.value = this.samples > NOISE_EVERY ? this.calm : 0;
    this.drawn++;
    const { gathered, gatheredScale } = this;
    this.drawPaths(renderer, eyes, views, begins, history, gathered, gatheredScale);
  }

  private drawPaths(
    renderer: WebGLRenderer,
    eyes: Eyes,
    views: readonly TraceView[],
    begins: readonly TraceView[],
    history: History,
    target: WebGLRenderTarget,
    scale: number,
  ): void {
    const { uniforms, uPart, scene } = this.pathPass;
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
        uniforms.uToBefore.value.copy(this.anchors[k].fromBox);
        uniforms.uEyeBefore.value.copy(this.anchors[k].eye);
      }
      k++;
    });
  }

  /** From um of the box to the room. */
  private boxMatrix(specimen: Matrix4): Matrix4 {
    if (this.texels === null) throw new Error("there is nothing to trace");
    const { frame } = this.texels;
    return specimen
      .clone()
      .multiply(new Matrix4().fromArray([...frame.matrix]))
      .multiply(lowCorner(frame.min));
  }

  dispose(): void {
    for (const target of this.sums) target.dispose();
    this.textures.dispose();
    this.texels?.release();
    this.pathPass.dispose();
    this.noise.dispose();
    this.probe.dispose();
    this.denoiseAndTone.dispose();
  }
}
