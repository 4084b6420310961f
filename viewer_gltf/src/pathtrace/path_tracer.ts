/**
 * Traces paths of light frame by frame, and sums up the light of each pixel's paths in float textures. While the view
 * rests, the sums grow. If it trembles, they are carried over to the moved view, and a new view starts from zero.
 */
import type { Matrix4, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import { SKIP_BRICK, STREAM_BRICK } from "../bundle/generated/constants";
import type { Eyes } from "../gpu/eyes";
import { OWN_LIGHT } from "../gpu/scene_light";
import { ScreenPass } from "../gpu/screen_pass";
import type { MarchedFrame, TraceScene } from "../render/drawn_forms";
import { ENOUGH_SAMPLES, type TraceSettings } from "../state/path_trace_settings";
import type { MarchLight } from "../voxels/march_frame";
import { DenoiseAndTone } from "./denoise_and_tone";
import type { EnvironmentTables } from "./environment_sampling";
import type { MediumAppearance } from "./extinction";
import { type History, historyOf, type TraceView, viewOf } from "./eye_rays";
import { LightProbe } from "./light_probe";
import { type Hemispheres, hemispheresOf, lightMarch } from "./march_light";
import type { MediumTexels } from "./medium_loader";
import { MediumTextures } from "./medium_textures";
import { PathSums } from "./path_sums";
import { TRACE_FRAGMENT } from "./shaders/sources";
import { NOISE_TILE } from "./tile_noise";
import {
  boxToWorld,
  keyOf,
  matterOf,
  sceneInto,
  type TraceUniforms,
  texelsInto,
  traceUniforms,
} from "./uniforms";

/** Standard error of a tile's mean luminance below which the tile is rarely sampled. */
const CALM = 0.004;
/** Largest number of samples that are kept when the view has moved a little. */
const MAX_ASIDE = 48;

/** Settings for gathering the samples of one frame. */
export type Gathering = Readonly<{
  /** Resolution of the traced frame relative to the frame buffer, 0..1. */
  scale: number;
  /** Number of samples for every pixel; below 1, the share of pixels that get one sample. */
  passes: number;
  /**
   * Whether eyes that only tremble still use the gathered paths, which then begin at the earlier eye positions.
   */
  mayTremble: boolean;
  /** Whether paths are shorter, because a moving frame has to be quick. */
  isDraft: boolean;
  /** Ray-marched frame that is shown for pixels with few samples; null: there is none. */
  standIn?: MarchedFrame | null;
}>;

type Drawing = Pick<Gathering, "scale" | "isDraft">;

/** Number of samples from which no pixel needs the ray-marched frame: see tone_map.frag.glsl. */
const STOOD_IN = 5;

export class Tracer {
  private readonly probe = new LightProbe();
  private readonly denoiseAndTone = new DenoiseAndTone(this.probe);
  private environmentLight: readonly [number, number, number] = [0, 0, 0];
  private hemispheres: Hemispheres = OWN_LIGHT;
  private texels: MediumTexels | null = null;
  /** The views from which paths begin. They stay fixed as long as the eyes only tremble. */
  private anchors: readonly TraceView[] = [];
  /** The views of the previous frame. */
  private seen: readonly TraceView[] = [];
  private shownWith: TraceSettings | null = null;
  private key = "";
  private matter = "";
  private drawing: Drawing = { scale: 1, isDraft: false };
  /** Whether a ray-marched frame stands in for pixels with few samples. */
  isStoodIn = false;
  private readonly pathPass: ScreenPass<TraceUniforms>;
  private readonly sums: PathSums;
  private readonly textures: MediumTextures;

  /**
   * @param brick edge of a brick of majorants in texels: SKIP_BRICK or a multiple of it
   * @param calm standard error of the luminance below which a tile is sampled less often; 0: all tiles always are
   */
  constructor(sceneDepth: { value: Texture }, brick = 2 * SKIP_BRICK, calm = CALM) {
    this.pathPass = new ScreenPass(TRACE_FRAGMENT, traceUniforms(sceneDepth, MAX_ASIDE), {
      CHANNELS: 1,
      NOISE_TILE,
    });
    this.sums = new PathSums(this.pathPass, calm);
    this.textures = new MediumTextures(this.pathPass, brick);
  }

  /** The finished frame, sRGB-encoded with premultiplied alpha. */
  get picture(): WebGLRenderTarget {
    return this.denoiseAndTone.picture;
  }

  /** Number of samples of a pixel since the frame began. Tiles that are sampled less often have fewer. */
  get samples(): number {
    return this.sums.samples;
  }

  /**
   * Number of samples of a pixel whose paths belong to the current view. The others come from an
   * earlier view.
   */
  get rested(): number {
    return this.sums.rested;
  }

  /** Resolution of the traced frame relative to the frame buffer, 0..1. */
  get scale(): number {
    return this.denoiseAndTone.scale;
  }

  /** Sums of colour and coverage, and of squared luminance, samples, distance and openness. */
  get gathered(): WebGLRenderTarget {
    return this.sums.gathered;
  }

  get isReady(): boolean {
    return this.texels !== null;
  }

  /** Drops the samples, because the medium or the light has changed. */
  restart(): void {
    this.probe.forget();
    this.begin();
  }

  /** Starts to gather samples of another view. */
  private begin(): void {
    this.anchors = [];
    this.sums.begin();
    this.shownWith = null;
  }

  /** Sets the texels that paths go through, and takes ownership of their texture. */
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

  /** @param appearances one for each channel, in the order of the texture's channels */
  setAppearances(appearances: readonly MediumAppearance[], settings: TraceSettings): void {
    if (this.texels === null) return;
    this.textures.setAppearances(this.texels, appearances, settings.density);
    this.restart();
  }

  /** @param toEye rotation from the specimen's axes to the eye's */
  lightMarch(march: MarchLight, settings: TraceSettings, toEye: Matrix4): void {
    lightMarch(march, settings, this.hemispheres, toEye);
  }

  lightBy(tables: EnvironmentTables): void {
    this.environmentLight = tables.mean;
    this.hemispheres = hemispheresOf(tables);
    this.textures.lightBy(tables);
    this.restart();
  }

  /**
   * Returns whether the gathered samples can be used for these eyes.
   *
   * @param mayTremble see `render`
   */
  goesOn(eyes: Eyes, scene: TraceScene, mayTremble: boolean): boolean {
    if (this.texels === null) return false;
    const { scale, isDraft } = this.drawing;
    if (keyOf(eyes, scene, scale, isDraft) !== this.key) return false;
    const history = this.historyFor(this.viewsOf(eyes, scene), mayTremble);
    return history === "same" || (mayTremble && history === "aside");
  }

  /**
   * Makes the frame from the ray-marched one alone, and drops the samples, because the view is moving.
   *
   * @param marched the ray-marched frame of this view
   */
  standIn(
    renderer: WebGLRenderer,
    eyes: Eyes,
    scene: TraceScene,
    settings: TraceSettings,
    marched: MarchedFrame,
  ): void {
    if (this.texels === null) return;
    this.prepare(eyes, scene, settings, { ...this.drawing, isDraft: false });
    this.begin();
    const views = this.viewsOf(eyes, scene);
    this.probeLight(renderer, eyes, views, settings, marched);
    this.isStoodIn = true;
    this.denoiseAndTone.show(renderer, eyes, views, settings, true, { ...marched, rounds: 0 });
  }

  /**
   * Gathers more samples of every pixel, or of a share of the pixels. Makes the frame as soon as every pixel has one
   * sample. A frame that has enough samples is only reprojected to the eyes.
   */
  render(
    renderer: WebGLRenderer,
    eyes: Eyes,
    scene: TraceScene,
    settings: TraceSettings,
    { scale, passes, mayTremble, isDraft, standIn = null }: Gathering,
  ): void {
    if (this.texels === null) return;
    this.prepare(eyes, scene, settings, { scale, isDraft });
    const views = this.viewsOf(eyes, scene);
    const history = this.historyFor(views, mayTremble);
    this.seen = views;
    if (history === "none") this.begin();
    if (history === "aside") this.sums.keepAside(MAX_ASIDE);
    const begins = history === "same" ? this.anchors : views;
    const started = this.samples;
    const { anchors } = this;
    if (started < ENOUGH_SAMPLES) {
      this.sums.gather(renderer, { eyes, views, begins, anchors, history }, passes, scale);
      this.anchors = begins;
    }
    const { denoiseAndTone } = this;
    this.isStoodIn = standIn !== null && this.samples < STOOD_IN;
    // Samples of only some pixels are not shown. Until all pixels have one more, the previous frame or the
    // ray-marched one stays.
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

  /** Passes the scene to the shader. Samples are dropped if the scene differs from before. */
  private prepare(eyes: Eyes, scene: TraceScene, settings: TraceSettings, drawing: Drawing): void {
    const { scale, isDraft } = drawing;
    if (this.texels === null) return;
    const box = this.boxMatrix(scene.specimen);
    const { uniforms } = this.pathPass;
    sceneInto(uniforms, scene, this.texels.frame, box, settings, isDraft, this.environmentLight);
    const matter = matterOf(scene);
    if (matter !== this.matter) this.restart();
    this.matter = matter;
    const key = keyOf(eyes, scene, scale, isDraft);
    if (key !== this.key) this.begin();
    this.key = key;
    this.drawing = drawing;
  }

  /** Measures the brightness of the light with a few paths, for the ray-marched frame that stands in. */
  private probeLight(
    renderer: WebGLRenderer,
    eyes: Eyes,
    views: readonly TraceView[],
    { isPostOn, occlusion }: TraceSettings,
    { image }: MarchedFrame,
  ): void {
    this.probe.measure(renderer, eyes, image, isPostOn ? occlusion : 0, (target, scale) => {
      const { uniforms } = this.pathPass;
      uniforms.uCalm.value = 0;
      uniforms.uTurn.value.set(0, 1);
      const begins = views;
      this.sums.draw(
        renderer,
        { eyes, views, begins, anchors: [], history: "none" },
        target,
        scale,
      );
    });
  }

  private viewsOf(eyes: Eyes, { specimen }: TraceScene): TraceView[] {
    const box = this.boxMatrix(specimen);
    return eyes.all.map(({ camera }) => viewOf(camera, box));
  }

  private historyFor(views: readonly TraceView[], mayTremble: boolean): History {
    const { anchors, seen, rested } = this;
    const middle = this.pathPass.uniforms.uSize.value.clone().multiplyScalar(0.5);
    return historyOf(views, { anchors, seen: rested >= 1 ? seen : [], middle, mayTremble });
  }

  /** Returns the matrix from um of the box to the scene. */
  private boxMatrix(specimen: Matrix4): Matrix4 {
    if (this.texels === null) throw new Error("there is nothing to trace");
    return specimen.clone().multiply(boxToWorld(this.texels.frame));
  }

  dispose(): void {
    const { sums, textures, pathPass, probe, denoiseAndTone } = this;
    for (const each of [sums, textures, pathPass, probe, denoiseAndTone]) each.dispose();
    this.texels?.release();
  }
}
