/**
 * Gathers light along paths, frame by frame, in float textures: for every pixel the sum of what its
 * paths brought. A view that stays gathers on, one that trembles carries it along, a new one begins
 * anew.
 */
import type { Matrix4, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import { SKIP_BRICK, STREAM_BRICK } from "../bundle/generated/constants";
import type { Eyes } from "../gpu/eyes";
import { OWN_LIGHT } from "../gpu/room_light";
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
  standIn?: MarchedFrame | null;
}>;

type Drawing = Pick<Gathering, "scale" | "isDraft">;

/** Samples with which nothing stands in for any pixel: see tone_map.frag.glsl. */
const STOOD_IN = 5;

export class Tracer {
  private readonly probe = new LightProbe();
  private readonly denoiseAndTone = new DenoiseAndTone(this.probe);
  private roomLight: readonly [number, number, number] = [0, 0, 0];
  private hemispheres: Hemispheres = OWN_LIGHT;
  private texels: MediumTexels | null = null;
  /** From where paths begin: where the eyes were, as long as they only tremble. */
  private anchors: readonly TraceView[] = [];
  /** Where the eyes were in the frame before. */
  private seen: readonly TraceView[] = [];
  private shownWith: TraceSettings | null = null;
  private key = "";
  private matter = "";
  private drawing: Drawing = { scale: 1, isDraft: false };
  /** Whether a marched picture stands in for pixels with few samples. */
  isStoodIn = false;
  private readonly pathPass: ScreenPass<TraceUniforms>;
  private readonly sums: PathSums;
  private readonly textures: MediumTextures;

  /**
   * @param brick texels along an edge of a brick of majorants: SKIP_BRICK or a multiple
   * @param calm standard error of the luminance at which a tile rests more often; 0: none does
   */
  constructor(sceneDepth: { value: Texture }, brick = 2 * SKIP_BRICK, calm = CALM) {
    this.pathPass = new ScreenPass(TRACE_FRAGMENT, traceUniforms(sceneDepth, MAX_ASIDE), {
      CHANNELS: 1,
      NOISE_TILE,
    });
    this.sums = new PathSums(this.pathPass, calm);
    this.textures = new MediumTextures(this.pathPass, brick);
  }

  /** The picture, encoded and premultiplied. */
  get picture(): WebGLRenderTarget {
    return this.denoiseAndTone.picture;
  }

  /** Samples of a pixel since the picture began; tiles that rest have fewer. */
  get samples(): number {
    return this.sums.samples;
  }

  /** The samples among them whose paths are from the present view. */
  get rested(): number {
    return this.sums.rested;
  }

  /** Pixels of the picture to one of the frame buffer. */
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

  /** Begin a picture of another view. */
  private begin(): void {
    this.anchors = [];
    this.sums.begin();
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
    const { scale, isDraft } = this.drawing;
    if (keyOf(eyes, scene, scale, isDraft) !== this.key) return false;
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
  private prepare(eyes: Eyes, scene: TraceScene, settings: TraceSettings, drawing: Drawing): void {
    const { scale, isDraft } = drawing;
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
    this.drawing = drawing;
  }

  /** Find how much light there is, by a few paths, for the stand-in. */
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

  /** From um of the box to the room. */
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
