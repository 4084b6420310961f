/**
 * Gathers light along paths, frame by frame, in float textures: for every pixel the sum of what its
 * paths brought. A view that stays gathers on, one that trembles carries it along, a new one begins
 * anew.
 */
import {
  Camera,
  Data3DTexture,
  DataTexture,
  FloatType,
  HalfFloatType,
  Matrix3,
  Matrix4,
  NearestFilter,
  RedFormat,
  RGBAFormat,
  RGFormat,
  type Scene,
  type Texture,
  Vector2,
  Vector3,
  Vector4,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import type { Bounds } from "../bundle/generated/bundle";
import {
  TRACE_DENOISE,
  TRACE_FRAGMENT,
  TRACE_MEAN,
  TRACE_NOISE,
  TRACE_SHOW,
} from "../shaders/texts";
import type { Eyes } from "../view/eyes";
import { drawEyes } from "../view/offscreen";
import { brickCounts } from "../volume/brick_counts";
import { clipInto, type MarchClip } from "../volume/clip_uniforms";
import { ENTRIES } from "../volume/luts";
import type { EnvironmentTables } from "./environment";
import { coarserMajorants, type MediumLook, majorants, mediumTable, rowsOf } from "./extinction";
import type { MediumTexels } from "./medium";
import { ScreenPass } from "./screen_pass";
import { LAMPS, type TraceSettings } from "./settings";
import { historyOf, type TraceView, turnOf, viewOf } from "./view";

/** Pixels along the edge of a tile that rests or is sampled as a whole. */
export const NOISE_TILE = 16;
/** The noise of the tiles is looked at anew after so many samples. */
const NOISE_EVERY = 8;
/** At this one a tile is as good as done. */
const CALM = 0.004;
/** Samples that are kept of a view a little aside. */
const MOST_ASIDE = 48;
/** A path that is lit more brightly counts as one that is lit so. */
const MOST_LIGHT = 200;
/** More often no path is scattered, in a medium that swallows nothing. */
const MOST_SCATTERS = 512;
/** Exponent of a shiny surface's lobe. */
const GLOSS = 60;
/** With so many samples a pixel is left as it is: see trace_denoise.frag.glsl. */
const DENOISED = 192;
const DENOISE_GAPS = [1, 2, 4] as const;
const NOBODY = new Camera();
/** Texels along an edge of the bricks whose ranges come with the texels. */
const BRICK = 8;

/** Of the longest edge of the box. */
const LAMP_RADIUS = 0.08;
const OCCLUSION_REACH = 0.06;

export type TraceScene = Readonly<{
  /** From um of the bundle's world, before tiles' matrices, to the room. */
  specimen: Matrix4;
  clip: MarchClip;
  /** A number that changes with what is opaque in the room. */
  solids: number;
  /** The specimen's box, um: where lamps are told. */
  bounds: Bounds;
}>;

export class Tracer {
  /** Pixels of the picture to one of the frame buffer. */
  scale = 1;
  /** Samples of a pixel since the picture began anew; tiles that rest have fewer. */
  samples = 0;
  private readonly sums = [sumsTarget(), sumsTarget()];
  private readonly noise = floatTarget(1, FloatType);
  private readonly mean = floatTarget(2, HalfFloatType);
  private readonly spares = [floatTarget(1, HalfFloatType), floatTarget(1, HalfFloatType)];
  private readonly shown = new WebGLRenderTarget(1, 1, {
    depthBuffer: false,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });
  private readonly medium = floatTexture(ENTRIES, 1, RGBAFormat);
  private majorantTexture: Data3DTexture = float3D(new Float32Array(1), [1, 1, 1]);
  private environment: DataTexture = floatTexture(1, 1, RGBAFormat);
  private aliases: DataTexture = floatTexture(1, 1, RGFormat);
  private texels: MediumTexels | null = null;
  private views: TraceView[] = [];
  private drawn = 0;
  private shownWith: TraceSettings | null = null;
  /** Where among the tiles the next turn begins, 0..1. */
  private turn = 0;
  private key = "";
  private gatheredScale = 1;
  /** Whether samples have been carried along from a view aside: there are never many then. */
  private isTrembling = false;
  private readonly pathPass: ScreenPass<ReturnType<typeof traceUniforms>>;
  private readonly noisePass: ScreenPass<ReturnType<typeof sumUniforms>>;
  private readonly meanPass;
  private readonly denoisePass;
  private readonly showPass;

  /**
   * @param brick texels along an edge of a brick of majorants: 8 or a multiple
   * @param calm standard error of the luminance at which a tile rests more often; 0: none does
   */
  constructor(
    sceneDepth: { value: Texture },
    private readonly brick = 2 * BRICK,
    private readonly calm = CALM,
  ) {
    this.pathPass = new ScreenPass(TRACE_FRAGMENT, traceUniforms(sceneDepth), {
      CHANNELS: 1,
      NOISE_TILE,
    });
    this.noisePass = new ScreenPass(TRACE_NOISE, sumUniforms(), { NOISE_TILE });
    this.meanPass = new ScreenPass(TRACE_MEAN, {
      ...sumUniforms(),
      uEdge: { value: 1 },
      uOcclusion: { value: 0 },
    });
    this.denoisePass = new ScreenPass(TRACE_DENOISE, {
      uColor: nothing(),
      uGuide: nothing(),
      uGap: { value: 1 },
    });
    this.showPass = new ScreenPass(TRACE_SHOW, {
      uColor: nothing(),
      uExposure: { value: 1 },
      uSharpness: { value: 0 },
      uIsFilmic: { value: true },
      uTone: { value: new Vector3(0, 1, 0) },
    });
  }

  /** The picture, encoded and premultiplied. */
  get picture(): WebGLRenderTarget {
    return this.shown;
  }

  /** Sums of colour and coverage, and of squared luminance, samples, distance and openness. */
  get gathered(): WebGLRenderTarget {
    return this.sums[this.drawn % 2];
  }

  get isReady(): boolean {
    return this.texels !== null;
  }

  restart(): void {
    this.views = [];
    this.samples = 0;
  }

  /** What paths go through; takes over the texture. */
  fill(texels: MediumTexels | null): void {
    if (this.texels !== texels) this.texels?.release();
    this.texels = texels;
    this.restart();
    if (texels === null) return;
    const { frame, texture, channels } = texels;
    const { uniforms } = this.pathPass;
    uniforms.uVolume.value = uniforms.uOldVolume.value = texture;
    uniforms.uIndex.value = texels.index;
    uniforms.uTexels.value.set(...texels.size);
    this.pathPass.define("BRICKS", texels.index === null ? null : 1);
    this.pathPass.define("CHANNELS", channels.length);
    const size = frame.max.map((v, k) => v - frame.min[k]);
    uniforms.uSize.value.set(size[0], size[1], size[2]);
    uniforms.uVoxel.value = Math.min(...frame.spacing_um);
    const first = frame.size.map((n) => (frame.apron + 0.5) / n);
    const last = frame.size.map((n) => (n - frame.apron - 0.5) / n);
    uniforms.uTexLow.value.set(first[0], last[1], first[2]); // rows run against y
    uniforms.uTexPerUm.value.set(
      (last[0] - first[0]) / Math.max(size[0], 1e-9),
      (first[1] - last[1]) / Math.max(size[1], 1e-9),
      (last[2] - first[2]) / Math.max(size[2], 1e-9),
    );
    uniforms.uOcclusionReach.value = OCCLUSION_REACH * Math.max(...size);
    this.meanPass.uniforms.uEdge.value = Math.max(...size);
  }

  /** @param looks of the channels, in the order of the texture's */
  dress(looks: readonly MediumLook[], settings: TraceSettings): void {
    if (this.texels === null) return;
    const { frame, bricks, size } = this.texels;
    const voxel = Math.min(...frame.spacing_um);
    const table = mediumTable(looks, voxel, settings.bias, settings.density);
    this.medium.dispose();
    const rows = rowsOf(looks);
    this.medium.image = { data: table, width: ENTRIES, height: rows * looks.length };
    this.medium.needsUpdate = true;
    this.majorantTexture.dispose();
    const fine = majorants(table, bricks);
    const coarse = coarserMajorants(fine, brickCounts(size), this.brick / BRICK);
    this.majorantTexture = float3D(coarse.majorants, coarse.counts);
    const { uniforms } = this.pathPass;
    this.pathPass.define("TWO_D", rows === 1 ? null : 1);
    looks.forEach(({ plane }, c) => {
      uniforms.uGradientMax.value.setComponent(c, plane?.gradientMax ?? 1);
    });
    uniforms.uMedium.value = this.medium;
    uniforms.uMajorants.value = this.majorantTexture;
    uniforms.uBrick.value.setScalar(this.brick);
    this.restart();
  }

  lightBy({ width, height, light, aliases }: EnvironmentTables): void {
    this.environment.dispose();
    this.aliases.dispose();
    this.environment = floatTexture(width, height, RGBAFormat, light);
    this.aliases = floatTexture(width, height, RGFormat, aliases);
    this.pathPass.uniforms.uEnvironment.value = this.environment;
    this.pathPass.uniforms.uAliases.value = this.aliases;
    this.restart();
  }

  /** Whether the picture that is gathered is one of this very view. */
  isOf(eyes: Eyes, scene: TraceScene): boolean {
    if (this.texels === null || this.views.length !== eyes.all.length) return false;
    if (keyOf(eyes, scene, this.gatheredScale) !== this.key) return false;
    const box = this.boxMatrix(scene.specimen);
    const middle = this.pathPass.uniforms.uSize.value.clone().multiplyScalar(0.5);
    return eyes.all.every(
      ({ camera }, k) => historyOf(this.views[k], viewOf(camera, box), middle) === "same",
    );
  }

  /**
   * Gather so many more samples of every pixel, or of a share of them, and make the picture, as soon
   * as each pixel has one.
   *
   * @param scale pixels of the picture to one of the frame buffer, 0..1
   */
  render(
    renderer: WebGLRenderer,
    eyes: Eyes,
    scene: TraceScene,
    settings: TraceSettings,
    scale: number,
    passes: number,
  ): void {
    if (this.texels === null) return;
    this.follow(scene, settings);
    const key = keyOf(eyes, scene, scale);
    if (key !== this.key) this.restart();
    this.key = key;
    this.gatheredScale = scale;
    const box = this.boxMatrix(scene.specimen);
    const middle = this.pathPass.uniforms.uSize.value.clone().multiplyScalar(0.5);
    const share = Math.min(1, passes);
    const started = this.samples;
    for (let i = 0; i < Math.max(1, Math.floor(passes)); i++) {
      const views = eyes.all.map(({ camera }) => viewOf(camera, box));
      const histories = views.map((view, k) => historyOf(this.views[k], view, middle));
      if (this.views.length !== views.length || histories.includes("none")) {
        this.samples = this.turn = 0;
        this.shownWith = null;
      }
      this.isTrembling = histories.includes("aside");
      this.pathPass.uniforms.uTurn.value.set(this.turn, share);
      this.gather(renderer, eyes, scale, views, histories);
      this.views = views;
      const before = this.samples;
      this.samples = Math.round(1e6 * (before + share)) / 1e6;
      this.turn = (this.turn + share) % 1;
      const isDue = Math.floor(before / NOISE_EVERY) < Math.floor(this.samples / NOISE_EVERY);
      if (isDue) this.judge(renderer, this.gathered);
    }
    // a part of the pixels alone is not shown: until all have their turn, the picture before stays
    const isRound = Math.floor(this.samples) > Math.floor(started);
    if (this.samples < 1 || !(isRound || settings !== this.shownWith)) return;
    this.show(renderer, eyes, scale, settings);
    this.shownWith = settings;
    this.scale = scale;
  }

  private gather(
    renderer: WebGLRenderer,
    eyes: Eyes,
    scale: number,
    views: readonly TraceView[],
    histories: readonly ("none" | "same" | "aside")[],
  ): void {
    const { uniforms, uPart, scene } = this.pathPass;
    const before = this.gathered;
    uniforms.uSums.value = before.textures[0];
    uniforms.uMoments.value = before.textures[1];
    uniforms.uNoisiness.value = this.noise.texture;
    uniforms.uCalm.value = this.samples > NOISE_EVERY ? this.calm : 0;
    this.drawn++;
    uniforms.uSample.value = this.drawn;
    let k = 0;
    drawEyes(renderer, scene, eyes, this.gathered, scale, ({ viewport }, part) => {
      uPart.value.copy(part);
      uniforms.uEye.value.copy(viewport);
      const [view, old] = [views[k], this.views[k]];
      uniforms.uToBox.value.copy(view.toBox);
      uniforms.uEyeAt.value.copy(view.eye);
      uniforms.uHistory.value = { none: 0, same: 1, aside: 2 }[histories[k]];
      if (old !== undefined) {
        uniforms.uToBefore.value.copy(old.fromBox);
        uniforms.uEyeBefore.value.copy(old.eye);
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

  /** Mean, denoised where few paths have been gathered, and what comes after. */
  private show(renderer: WebGLRenderer, eyes: Eyes, scale: number, settings: TraceSettings): void {
    const { gathered, meanPass, denoisePass, showPass } = this;
    const { isPostOn } = settings;
    meanPass.uniforms.uSums.value = gathered.textures[0];
    meanPass.uniforms.uMoments.value = gathered.textures[1];
    meanPass.uniforms.uOcclusion.value = isPostOn ? settings.occlusion : 0;
    drawEyes(renderer, meanPass.scene, eyes, this.mean, scale);
    let color = this.mean.textures[0];
    if (this.isTrembling || this.samples < DENOISED) {
      denoisePass.uniforms.uGuide.value = this.mean.textures[1];
      for (const gap of DENOISE_GAPS) {
        const [one, other] = this.spares;
        const target = color === one.texture ? other : one;
        denoisePass.uniforms.uGap.value = gap;
        denoisePass.uniforms.uColor.value = color;
        drawEyes(renderer, denoisePass.scene, eyes, target, scale, (_, part) => {
          denoisePass.uPart.value.copy(part);
        });
        color = target.texture;
      }
    }
    const { uniforms } = showPass;
    uniforms.uColor.value = color;
    uniforms.uExposure.value = isPostOn ? 2 ** settings.exposure : 1;
    uniforms.uSharpness.value = isPostOn ? settings.sharpness : 0;
    uniforms.uIsFilmic.value = isPostOn && settings.toneMap === "filmic";
    uniforms.uTone.value.set(0, 1, 0);
    if (isPostOn) {
      uniforms.uTone.value.set(settings.hue / 360, settings.saturation, settings.lightness);
    }
    drawEyes(renderer, showPass.scene, eyes, this.shown, scale, (_, part) => {
      showPass.uPart.value.copy(part);
    });
  }

  private follow({ specimen, clip, bounds }: TraceScene, settings: TraceSettings): void {
    if (this.texels === null) return;
    const { uniforms } = this.pathPass;
    const { frame } = this.texels;
    const toWorld = new Matrix4().fromArray([...frame.matrix]).multiply(lowCorner(frame.min));
    const toBox = toWorld.clone().invert();
    clipInto(clip, toWorld, toBox, uniforms);
    const turn = new Matrix4().makeRotationY((settings.environmentTurn_deg * Math.PI) / 180);
    uniforms.uToRoom.value.copy(turnOf(turn.multiply(this.boxMatrix(specimen))));
    uniforms.uEnvironmentLight.value = settings.environmentLight;
    uniforms.uScatters.value = settings.isMultiple ? MOST_SCATTERS : 1;
    uniforms.uAnisotropy.value = settings.anisotropy;
    uniforms.uSurface.value = settings.surface;
    uniforms.uShine.value = settings.shine;
    const edge = Math.max(...bounds.max.map((v, k) => v - bounds.min[k]));
    const middle = new Vector3(...bounds.min).add(new Vector3(...bounds.max)).multiplyScalar(0.5);
    let count = 0;
    for (const { isOn, x, y, z, color, strength } of settings.lamps.slice(0, LAMPS)) {
      if (!isOn || strength <= 0) continue;
      const aside = new Vector3(x, y, z).multiplyScalar(edge);
      const at = aside.clone().add(middle).applyMatrix4(toBox);
      uniforms.uLamps.value[count].set(at.x, at.y, at.z, LAMP_RADIUS * edge);
      // irradiance pi in the middle is what a white room gives
      const intensity = strength * Math.PI * Math.max(aside.lengthSq(), (edge / 4) ** 2);
      uniforms.uLampLight.value[count].set(...color).multiplyScalar(intensity);
      count++;
    }
    uniforms.uLampCount.value = count;
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
    for (const target of [...this.sums, ...this.spares, this.noise, this.mean, this.shown]) {
      target.dispose();
    }
    for (const texture of [this.medium, this.majorantTexture, this.environment, this.aliases]) {
      texture.dispose();
    }
    this.texels?.release();
    for (const pass of [
      this.pathPass,
      this.noisePass,
      this.meanPass,
      this.denoisePass,
      this.showPass,
    ]) {
      pass.dispose();
    }
  }
}

/** What a picture can't be gathered on without: another one begins anew. */
function keyOf({ width_px, height_px }: Eyes, { solids, clip }: TraceScene, scale: number): string {
  return `${width_px} ${height_px} ${scale} ${solids} ${JSON.stringify(clip)}`;
}

function nothing(): { value: Texture | null } {
  return { value: null };
}

function sumUniforms() {
  return { uSums: nothing(), uMoments: nothing() };
}

function traceUniforms(uSceneDepth: { value: Texture }) {
  return {
    ...sumUniforms(),
    uNoisiness: nothing(),
    uSize: { value: new Vector3(1, 1, 1) },
    uTexLow: { value: new Vector3() },
    uTexPerUm: { value: new Vector3(1, -1, 1) },
    uVoxel: { value: 1 },
    uTexels: { value: new Vector3(1, 1, 1) },
    uVolume: nothing(),
    uIndex: nothing(),
    uOldVolume: nothing(),
    uFresh: { value: 1 },
    uMedium: nothing(),
    uGradientMax: { value: new Vector4(1, 1, 1, 1) },
    uMajorants: nothing(),
    uBrick: { value: new Vector3(BRICK, BRICK, BRICK) },
    uClipLow: { value: new Vector3() },
    uClipHigh: { value: new Vector3() },
    uClipPlane: { value: new Vector4(0, 0, 0, 1) },
    uToBox: { value: new Matrix4() },
    uEyeAt: { value: new Vector3() },
    uToRoom: { value: new Matrix3() },
    uEye: { value: new Vector4(0, 0, 1, 1) },
    uSceneDepth,
    uEnvironment: nothing(),
    uAliases: nothing(),
    uEnvironmentLight: { value: 1 },
    uLampCount: { value: 0 },
    uLamps: { value: Array.from({ length: LAMPS }, () => new Vector4()) },
    uLampLight: { value: Array.from({ length: LAMPS }, () => new Vector3()) },
    uScatters: { value: MOST_SCATTERS },
    uAnisotropy: { value: 0 },
    uSurface: { value: 0 },
    uShine: { value: 0 },
    uGloss: { value: GLOSS },
    uOcclusionReach: { value: 1 },
    uMostLight: { value: MOST_LIGHT },
    uSample: { value: 0 },
    uHistory: { value: 0 },
    uToBefore: { value: new Matrix4() },
    uEyeBefore: { value: new Vector3() },
    uMostHistory: { value: MOST_ASIDE },
    uTurn: { value: new Vector2(0, 1) },
    uCalm: { value: 0 },
  };
}

function lowCorner([x, y, z]: readonly [number, number, number]): Matrix4 {
  return new Matrix4().makeTranslation(x, y, z);
}

const EXACT = { minFilter: NearestFilter, magFilter: NearestFilter } as const;

function floatTarget(count: number, type: typeof FloatType | typeof HalfFloatType) {
  return new WebGLRenderTarget(1, 1, { count, type, depthBuffer: false, ...EXACT });
}

function sumsTarget(): WebGLRenderTarget {
  return floatTarget(2, FloatType);
}

function floatTexture(
  width: number,
  height: number,
  format: typeof RGBAFormat | typeof RGFormat,
  data?: Float32Array<ArrayBuffer>,
): DataTexture {
  const parts = format === RGBAFormat ? 4 : 2;
  const texels = data ?? new Float32Array(width * height * parts);
  const texture = new DataTexture(texels, width, height, format, FloatType);
  Object.assign(texture, EXACT);
  texture.needsUpdate = true;
  return texture;
}

function float3D(data: Float32Array<ArrayBuffer>, size: readonly [number, number, number]) {
  const texture = new Data3DTexture(data, ...size);
  texture.format = RedFormat;
  texture.type = FloatType;
  Object.assign(texture, EXACT);
  texture.unpackAlignment = 4;
  texture.needsUpdate = true;
  return texture;
}

/** Draw over a target that becomes so large. */
function drawWhole(
  renderer: WebGLRenderer,
  scene: Scene,
  target: WebGLRenderTarget,
  width: number,
  height: number,
): void {
  const before = renderer.getRenderTarget();
  const { enabled } = renderer.xr;
  renderer.xr.enabled = false;
  target.setSize(width, height);
  target.viewport.set(0, 0, width, height);
  renderer.setRenderTarget(target);
  renderer.render(scene, NOBODY);
  renderer.setRenderTarget(before);
  renderer.xr.enabled = enabled;
}
