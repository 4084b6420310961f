/**
 * Turns the gathered sums into the finished frame. The mean is denoised where pixels have few samples, reprojected to
 * the current eyes, and then exposed, sharpened and tone-mapped.
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

/** Number of samples from which no pixel is denoised: `ENOUGH` of denoise.frag.glsl. */
const DENOISED = 192;
const DENOISE_GAPS = [1, 2, 4] as const;

/** The ray-marched frame that stands in for the traced one; `rounds`: samples that every traced pixel has. */
export type StandIn = MarchedFrame & Readonly<{ rounds: number }>;

export class DenoiseAndTone {
  /** The finished frame, sRGB-encoded with premultiplied alpha. */
  readonly picture = byteTarget();
  /** Resolution of the finished frame relative to the frame buffer. */
  scale = 1;
  /** Resolution of the mean relative to the frame buffer. */
  private meanScale = 1;
  private readonly mean = floatTarget(2, HalfFloatType);
  private readonly spares = [floatTarget(1, HalfFloatType), floatTarget(1, HalfFloatType)];
  private color: Texture = this.mean.textures[0];
  /** The views from which the paths of the mean began, and the views of the finished frame. */
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

  /** @param probe measures the light of the stand-in and of the traced frame */
  constructor(private readonly probe: LightProbe) {}

  /** Prepares for sums of another box. @param size edges of that box, um */
  expect(size: Vector3): void {
    this.size.copy(size);
    this.began = this.shown = [];
  }

  /**
   * Computes the denoised mean of the sums.
   *
   * @param sums the textures that path_trace.frag.glsl writes
   * @param samples largest number of samples of a pixel
   * @param views views from which the paths begin
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
   * Makes the finished frame for these eyes from the denoised mean, unless it would be the same as before.
   *
   * @param standIn the frame that is shown while pixels have few samples
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

  /** Returns the target that does not contain the current colour. */
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
