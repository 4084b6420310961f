/**
 * Gathers light along paths, frame by frame, in float textures: for every pixel the sum of what its
 * paths brought. A view that stays gathers on, one that trembles carries it along, a new one begins
 * anew.
 */
import {
  type Data3DTexture,
  type DataTexture,
  FloatType,
  Matrix4,
  RGBAFormat,
  RGFormat,
  type Texture,
  type Vector3,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import { SKIP_BRICK, STREAM_BRICK } from "../bundle/generated/constants";
import type { Eyes } from "../gpu/eyes";
import { drawWhole, float3D, floatTarget, floatTexture } from "../gpu/float_targets";
import { drawEyes } from "../gpu/offscreen_target";
import { ScreenPass } from "../gpu/screen_pass";
import { ENOUGH_SAMPLES, type TraceSettings } from "../state/path_trace_settings";
import { brickCounts } from "../volumes/skip_bricks";
import { ENTRIES, edgeContrast } from "../volumes/transfer_luts";
import { tablesInto } from "../volumes/transfer_table_2d";
import { DenoiseAndTone, type Marched } from "./denoise_and_tone";
import type { EnvironmentTables } from "./environment_sampling";
import {
  coarserMajorants,
  type MediumAppearance,
  majorants,
  mediumTable,
  rowsOf,
} from "./extinction";
import { areNear, areSame, type History, type TraceView, viewOf } from "./eye_rays";
import type { MediumTexels } from "./medium_loader";
import { TRACE_FRAGMENT, TRACE_NOISE } from "./shaders/sources";
import {
  lowCorner,
  sceneInto,
  sumUniforms,
  type TraceScene,
  type TraceUniforms,
  texelsInto,
  traceUniforms,
} from "./uniforms";

/** Pixels along the edge of a tile that rests or is sampled as a whole. */
export const NOISE_TILE = 16;
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
  private readonly noise = floatTarget(1, FloatType);
  private readonly denoiseAndTone = new DenoiseAndTone();
  private readonly medium = floatTexture(ENTRIES, 1, RGBAFormat);
  private majorantTexture: Data3DTexture = float3D(new Float32Array(1), [1, 1, 1]);
  private environment: DataTexture = floatTexture(1, 1, RGBAFormat);
  private aliases: DataTexture = floatTexture(1, 1, RGFormat);
  private roomLight: readonly [number, number, number] = [0, 0, 0];
  private texels: MediumTexels | null = null;
  /** From where paths begin: where the eyes were, as long as they only tremble. */
  private anchors: readonly TraceView[] = [];
  /** Where the eyes were in the frame before. */
  private seen: readonly TraceView[] = [];
  private drawn = 0;
  private shownWith: TraceSettings | null = null;
  /** Where among the tiles the next turn begins, 0..1. */
  private turn = 0;
  private key = "";
  private gatheredScale = 1;
  private isDraft = false;
  /** Whether a marched picture stands in for pixels with few samples. */
  isStoodIn = false;
  private readonly pathPass: ScreenPass<TraceUniforms>;
  private readonly noisePass = new ScreenPass(TRACE_NOISE, sumUniforms(), { NOISE_TILE });

  /**
   * @param brick texels along an edge of a brick of majorants: SKIP_BRICK or a multiple
   * @param calm standard error of the luminance at which a tile rests more often; 0: none does
   */
  constructor(
    sceneDepth: { value: Texture },
    private readonly brick = 2 * SKIP_BRICK,
    private readonly calm = CALM,
  ) {
    this.pathPass = new ScreenPass(TRACE_FRAGMENT, traceUniforms(sceneDepth, MAX_ASIDE), {
      CHANNELS: 1,
      NOISE_TILE,
    });
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

  restart(): void {
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

  /** @param looks of the channels, in the order of the texture's */
  setAppearances(appearances: readonly MediumAppearance[], settings: TraceSettings): void {
    if (this.texels === null) return;
    const { frame, bricks, size } = this.texels;
    const voxel = Math.min(...frame.spacing_um);
    const table = mediumTable(appearances, voxel, settings.bias, settings.density);
    this.medium.dispose();
    const rows = rowsOf(appearances);
    this.medium.image = { data: table, width: ENTRIES, height: rows * appearances.length };
    this.medium.needsUpdate = true;
    this.majorantTexture.dispose();
    const fine = majorants(table, bricks);
    const coarse = coarserMajorants(fine, brickCounts(size), this.brick / SKIP_BRICK);
    this.majorantTexture = float3D(coarse.majorants, coarse.counts);
    const { uniforms } = this.pathPass;
    this.pathPass.define("TWO_D", rows === 1 ? null : 1);
    tablesInto(
      uniforms,
      appearances.map(({ table2d }) => table2d),
    );
    uniforms.uMedium.value = this.medium;
    appearances.forEach((each, c) => {
      uniforms.uContrast.value.setComponent(c, edgeContrast(each.table));
    });
    uniforms.uMajorants.value = this.majorantTexture;
    uniforms.uBrick.value.setScalar(this.brick);
    this.restart();
  }

  lightBy({ width, height, light, aliases, mean }: EnvironmentTables): void {
    this.roomLight = mean;
    this.environment.dispose();
    this.aliases.dispose();
    this.environment = floatTexture(width, height, RGBAFormat, light);
    this.aliases = floatTexture(width, height, RGFormat, aliases);
    this.pathPass.uniforms.uEnvironment.value = this.environment;
    this.pathPass.uniforms.uAliases.value = this.aliases;
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
   * Gather so many more samples of every pixel, or of a share of them, and make the picture, as soon
   * as each pixel has one. A picture with enough of them only follows the eyes.
   *
   */
  render(
    renderer: WebGLRenderer,
    eyes: Eyes,
    scene: TraceScene,
    settings: TraceSettings,
    { scale, passes, mayTremble, isDraft, standIn = null }: Gathering,
  ): void {
    if (this.texels === null) return;
    const { frame } = this.texels;
    const box = this.boxMatrix(scene.specimen);
    sceneInto(this.pathPass.uniforms, scene, frame, box, settings, isDraft, this.roomLight);
    const key = keyOf(eyes, scene, scale, isDraft);
    if (key !== this.key) this.restart();
    this.key = key;
    this.gatheredScale = scale;
    this.isDraft = isDraft;
    const views = this.viewsOf(eyes, scene);
    let history = this.historyFor(views, mayTremble);
    this.seen = views;
    if (history === "none") this.restart();
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
      if (isDue) this.judge(renderer, this.gathered);
    }
    const { denoiseAndTone } = this;
    if (standIn === null || this.samples >= STOOD_IN) this.isStoodIn = false;
    else if (!denoiseAndTone.isOf(begins)) this.isStoodIn = true;
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
    const rounds = Math.floor(this.samples);
    const marched = this.isStoodIn && standIn !== null ? { ...standIn, rounds } : null;
    denoiseAndTone.show(renderer, eyes, views, settings, isOther, marched);
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
    const { uniforms, uPart, scene } = this.pathPass;
    const before = this.gathered;
    uniforms.uSums.value = before.textures[0];
    uniforms.uMoments.value = before.textures[1];
    uniforms.uNoisiness.value = this.noise.texture;
    uniforms.uCalm.value = this.samples > NOISE_EVERY ? this.calm : 0;
    this.drawn++;
    uniforms.uSample.value = this.drawn;
    uniforms.uHistory.value = { none: 0, same: 1, aside: 2 }[history];
    let k = 0;
    drawEyes(renderer, scene, eyes, this.gathered, this.gatheredScale, ({ viewport }, part) => {
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

  /** How noisy each tile is. */
  private judge(renderer: WebGLRenderer, sums: WebGLRenderTarget): void {
    const { uniforms, scene } = this.noisePass;
    uniforms.uSums.value = sums.textures[0];
    uniforms.uMoments.value = sums.textures[1];
    drawWhole(
      renderer,
      scene,
      this.noise,
      Math.ceil(sums.width / NOISE_TILE),
      Math.ceil(sums.height / NOISE_TILE),
    );
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
    for (const target of [...this.sums, this.noise]) target.dispose();
    for (const texture of [this.medium, this.majorantTexture, this.environment, this.aliases]) {
      texture.dispose();
    }
    this.texels?.release();
    this.pathPass.dispose();
    this.noisePass.dispose();
    this.denoiseAndTone.dispose();
  }
}

/** What a picture can't be gathered on without: another one begins anew. */
function keyOf(
  { width_px, height_px }: Eyes,
  { solids, clip }: TraceScene,
  scale: number,
  isDraft: boolean,
): string {
  return `${width_px} ${height_px} ${scale} ${isDraft} ${solids} ${JSON.stringify(clip)}`;
}
