/**
 * From what was gathered to the picture: its mean, denoised where few paths have been gathered, as
 * it is seen from where the eyes are by now, and what comes after the light.
 */

import {
  HalfFloatType,
  Matrix4,
  type Texture,
  Vector3,
  Vector4,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import type { Eyes } from "../gpu/eyes";
import { byteTarget, floatTarget, nothing } from "../gpu/float_targets";
import { drawEyes, partOf } from "../gpu/offscreen_target";
import { ScreenPass } from "../gpu/screen_pass";
import type { MarchedFrame } from "../render/drawn_forms";
import type { TraceSettings } from "../state/path_trace_settings";
import { areSame, type TraceView } from "./eye_rays";
import type { LightProbe } from "./light_probe";
import { TRACE_DENOISE, TRACE_MEAN, TRACE_SHOW, TRACE_WARP } from "./shaders/sources";

/** Samples with which a pixel is left as it is: see denoise.frag.glsl. */
const DENOISED = 192;
const DENOISE_GAPS = [1, 2, 4] as const;

/** The marched picture in place of a traced one, and the samples that every pixel of that has. */
export type StandIn = MarchedFrame & Readonly<{ rounds: number }>;

export class DenoiseAndTone {
  /** Encoded, premultiplied. */
  readonly picture = byteTarget();
  /** Pixels of the picture to one of the frame buffer. */
  scale = 1;
  /** Pixels of the mean light to one of the frame buffer. */
  private meanScale = 1;
  private readonly mean = floatTarget(2, HalfFloatType);
  private readonly spares = [floatTarget(1, HalfFloatType), floatTarget(1, HalfFloatType)];
  private color: Texture = this.mean.textures[0];
  /** From where the paths of the mean began, and from where the picture is seen. */
  private began: readonly TraceView[] = [];
  private shown: readonly TraceView[] = [];
  private readonly size = new Vector3(1, 1, 1);
  private readonly meanPass = new ScreenPass(TRACE_MEAN, {
    uSums: nothing(),
    uMoments: nothing(),
    uEdge: { value: 1 },
    uOcclusion: { value: 0 },
  });
  private readonly denoisePass = new ScreenPass(TRACE_DENOISE, {
    uColor: nothing(),
    uGuide: nothing(),
    uGap: { value: 1 },
  });
  private readonly warpPass = new ScreenPass(TRACE_WARP, {
    uColor: nothing(),
    uGuide: nothing(),
    uEdge: { value: 1 },
    uAway: { value: 1 },
    uToBox: { value: new Matrix4() },
    uEyeAt: { value: new Vector3() },
    uFromBox: { value: new Matrix4() },
    uEyeThere: { value: new Vector3() },
  });
  private readonly showPass = new ScreenPass(TRACE_SHOW, {
    uTracedLight: nothing(),
    uMarchedLight: nothing(),
    uColor: nothing(),
    uExposure: { value: 1 },
    uSharpness: { value: 0 },
    uIsFilmic: { value: true },
    uTone: { value: new Vector3(0, 1, 0) },
    uGuide: nothing(),
    uMarched: nothing(),
    uRounds: { value: 0 },
    uMarchedPart: { value: new Vector4() },
  });

  /** @param probe what finds the light of the stand-in */
  constructor(private readonly probe: LightProbe) {}

  /** @param size um: what is gathered from now on is of another box */
  expect(size: Vector3): void {
    this.size.copy(size);
    this.began = this.shown = [];
  }

  /**
   * @param sums as path_trace.frag.glsl writes them
   * @param samples most that a pixel has
   * @param views from where its paths begin
   */
  denoise(
    renderer: WebGLRenderer,
    eyes: Eyes,
    sums: WebGLRenderTarget,
    samples: number,
    views: readonly TraceView[],
    scale: number,
    { isPostOn, occlusion }: TraceSettings,
  ): void {
    const { meanPass, denoisePass } = this;
    meanPass.uniforms.uSums.value = sums.textures[0];
    meanPass.uniforms.uMoments.value = sums.textures[1];
    meanPass.uniforms.uEdge.value = Math.max(...this.size);
    meanPass.uniforms.uOcclusion.value = isPostOn ? occlusion : 0;
    drawEyes(renderer, meanPass.scene, eyes, this.mean, scale);
    this.color = this.mean.textures[0];
    if (samples < DENOISED) {
      denoisePass.uniforms.uGuide.value = this.mean.textures[1];
      for (const gap of DENOISE_GAPS) {
        const target = this.spare();
        denoisePass.uniforms.uGap.value = gap;
        denoisePass.uniforms.uColor.value = this.color;
        drawEyes(renderer, denoisePass.scene, eyes, target, scale, (_, part) => {
          denoisePass.uPart.value.copy(part);
        });
        this.color = target.texture;
      }
    }
    this.meanScale = scale;
    this.began = views;
    this.shown = [];
  }

  /**
   * Make the picture of what was developed, as these eyes see it; if that differs.
   *
   * @param standIn what is shown while pixels have few samples
   */
  show(
    renderer: WebGLRenderer,
    eyes: Eyes,
    views: readonly TraceView[],
    settings: TraceSettings,
    isOther: boolean,
    standIn: StandIn | null = null,
  ): void {
    const { began, showPass } = this;
    const isAlone = standIn !== null && standIn.rounds === 0;
    if (!isAlone && began.length !== views.length) return;
    if (!isOther && standIn === null && areSame(views, this.shown)) return;
    this.shown = views;
    this.scale = isAlone ? standIn.scale : this.meanScale;
    const { uniforms } = showPass;
    const isSame = isAlone || areSame(views, began);
    uniforms.uColor.value = isSame ? this.color : this.warp(renderer, eyes, views);
    const { isPostOn } = settings;
    uniforms.uExposure.value = isPostOn ? 2 ** settings.exposure : 1;
    uniforms.uSharpness.value = isPostOn ? settings.sharpness : 0;
    uniforms.uIsFilmic.value = isPostOn && settings.toneMap === "filmic";
    uniforms.uTone.value.set(0, 1, 0);
    if (isPostOn) {
      uniforms.uTone.value.set(settings.hue / 360, settings.saturation, settings.lightness);
    }
    uniforms.uGuide.value = this.mean.textures[1];
    uniforms.uRounds.value = standIn?.rounds ?? 0;
    uniforms.uMarched.value = standIn?.image ?? null;
    uniforms.uTracedLight.value = this.probe.light.traced;
    uniforms.uMarchedLight.value = this.probe.light.marched;
    drawEyes(renderer, showPass.scene, eyes, this.picture, this.scale, (eye, part) => {
      showPass.uPart.value.copy(part);
      if (standIn === null) uniforms.uMarchedPart.value.setZ(0);
      else partOf(eye, standIn.scale, uniforms.uMarchedPart.value);
    });
  }

  private warp(renderer: WebGLRenderer, eyes: Eyes, views: readonly TraceView[]): Texture {
    const { uniforms, scene, uPart } = this.warpPass;
    const target = this.spare();
    uniforms.uColor.value = this.color;
    uniforms.uGuide.value = this.mean.textures[1];
    uniforms.uEdge.value = Math.max(...this.size);
    const middle = this.size.clone().multiplyScalar(0.5);
    let k = 0;
    drawEyes(renderer, scene, eyes, target, this.meanScale, (_, part) => {
      const [now, there] = [views[k], this.began[k]];
      uPart.value.copy(part);
      uniforms.uToBox.value.copy(now.toBox);
      uniforms.uEyeAt.value.copy(now.eye);
      uniforms.uFromBox.value.copy(there.fromBox);
      uniforms.uEyeThere.value.copy(there.eye);
      uniforms.uAway.value = now.eye.distanceTo(middle);
      k++;
    });
    return target.texture;
  }

  /** The target that doesn't hold the colour. */
  private spare(): WebGLRenderTarget {
    const [one, other] = this.spares;
    return this.color === one.texture ? other : one;
  }

  dispose(): void {
    for (const target of [this.mean, ...this.spares, this.picture]) target.dispose();
    for (const pass of [this.meanPass, this.denoisePass, this.warpPass, this.showPass]) {
      pass.dispose();
    }
  }
}
