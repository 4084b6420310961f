/**
 * Draws one frame: depth of the surfaces, volumes marched up to it, the scene, and the volumes over
 * it. Light is linear until the end, when it is encoded once.
 */
import {
  Matrix4,
  type Object3D,
  Scene,
  type Texture,
  Vector3,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import type { Bounds } from "../bundle/generated/bundle";
import { BothEyes } from "../gpu/both_eyes";
import { Cuts } from "../gpu/clip_planes";
import { LAST, Overlay } from "../gpu/composite_pass";
import { EncodePass } from "../gpu/encode_pass";
import { Eyes } from "../gpu/eyes";
import { drawWhole } from "../gpu/float_targets";
import { hasEdges } from "../gpu/has_edges";
import { linearTarget } from "../gpu/linear_target";
import type { Clip } from "../math/clip";
import { lightByScene, makeFrame, REST_STEPS } from "../voxels/march_frame";
import { type BlendedScene, makeSurfaceFrame, type SurfaceFrame } from "./blend_material";
import { CrossFade } from "./cross_fade";
import { DepthPass } from "./depth_pass";
import type { MarchedVolumes, TracedVolumes } from "./drawn_forms";
import type { GazeFocus } from "./gaze_focus";
import { MarchPass } from "./raymarch_pass";
import type { SpecimenScene } from "./specimen_scene";

export type Drawn = Readonly<{
  /** The marched volumes; null if no part of the viewer draws volumes. */
  volumes: MarchedVolumes | null;
  /** The path-traced volumes; null if no part of the viewer traces paths. */
  traced: TracedVolumes | null;
  panes: readonly BlendedScene[];
  /** Other objects that are not opaque, besides those of the scene itself. */
  overlays: readonly Object3D[];
  /** The box of the specimen, um. */
  bounds: Bounds;
  /** The tile that is drawn as a volume among surfaces, um, or null. */
  openTile: Bounds | null;
  /** A number that changes when the opaque surfaces change. */
  solids: number;
}>;

/** The quality of one frame. */
export type FramePace = Readonly<{
  /** Pixels of the marched image for each pixel of the frame, along an edge, 0 to 1. */
  resolution: number;
  isMoving: boolean;
  /** Path-traced samples that are added to each pixel in this frame. */
  passes: number;
  /**
   * Whether edges are anti-aliased, which takes a third of a frame of surfaces on a software
   * renderer.
   */
  isSmooth: boolean;
  /**
   * Whether nothing has changed since the last frame, so that the march is averaged with earlier
   * ones.
   */
  gathers: boolean;
}>;

/**
 * Cosines of the inner and outer radius of a disc that covers the whole view, and of an empty disc.
 */
const EVERYWHERE = [-2, -3] as const;
const NOWHERE = [3, 2] as const;
/** Largest number of frames of a view at rest that are averaged. */
const MAX_GATHERED = 64;
/** Golden ratio: any number of its multiples, modulo 1, fill 0 to 1 evenly. */
const GOLDEN = (Math.sqrt(5) - 1) / 2;
/** Pixels beyond the disc's rim that the march inside it must cover for mixing. */
const MIXED_PX = 2;

export class FrameRenderer {
  readonly eyes = new Eyes();
  private readonly both = new BothEyes();
  private readonly cuts = new Cuts();
  private readonly depth = new DepthPass(this.cuts, this.both);
  /** Uniforms that all volumes share. */
  readonly marchFrame = makeFrame(this.depth.texture, this.depth.paneTexture);
  /** Uniforms that all surfaces share. */
  readonly surfaceFrame: SurfaceFrame;
  private readonly march: MarchPass;
  /** The disc's cone in the scene, metres. */
  private readonly cone = {
    uApex: { value: new Vector3() },
    uAxis: { value: new Vector3(0, 0, -1) },
    uRim: { value: 1 },
  };
  /** Target of the whole frame in linear light, before it is encoded. */
  private readonly light: WebGLRenderTarget;
  /**
   * Target of a frame in linear light without anti-aliasing, for moving views that are late and for
   * frames without edges.
   */
  private readonly draft: WebGLRenderTarget;
  private readonly encode = new EncodePass();
  /** Fades from the frame before a jump to the frame after it. */
  readonly fade: CrossFade;
  private last: WebGLRenderTarget | null = null;
  /** Frame and march inside the disc, used if a channel is also a volume beyond the disc. */
  private readonly within: WebGLRenderTarget;
  private readonly marchWithin: MarchPass;
  private readonly overWithin: Overlay;
  private readonly mixed = new Scene();
  private moved = 0;
  /** Key of the march that stands in for path tracing; "" if it must be drawn. */
  private standInKey = "";
  private readonly point = new Vector3();
  private readonly lamp = new Vector3();
  private readonly corner = new Vector3();
  private readonly toSpecimen = new Matrix4();
  private readonly toEye = new Matrix4();

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly specimenScene: SpecimenScene,
    private readonly gazeFocus: GazeFocus,
  ) {
    const { uDisc, uIsCrossing } = this.marchFrame;
    const disc = { ...this.cone, uDisc, uIsCrossing };
    this.march = new MarchPass(renderer, this.marchFrame, disc);
    this.surfaceFrame = makeSurfaceFrame(disc, this.march.uniforms, this.cuts, this.both);
    this.light = linearTarget(renderer, { hasDepth: true, isMultisampled: true });
    this.draft = linearTarget(renderer, { hasDepth: true });
    this.fade = new CrossFade(renderer);
    this.within = linearTarget(renderer, { hasDepth: true, isMultisampled: true });
    this.marchWithin = new MarchPass(renderer, this.marchFrame);
    const { uSceneDepth } = this.marchFrame;
    const whole = { ...disc, uIsCrossing: { value: true } };
    this.overWithin = new Overlay(this.within.texture, uSceneDepth, { order: LAST, disc: whole });
    this.mixed.add(this.overWithin.mesh);
    specimenScene.scene.add(...this.march.overlays, ...this.marchWithin.overlays);
  }

  /**
   * Draws a frame.
   *
   * @param head pose of the head in the scene
   * @param clip the clip planes and box
   * @param pace the quality that the time for a frame allows
   */
  draw(
    head: Matrix4,
    drawn: Drawn,
    clip: Clip,
    { resolution, isMoving, passes, isSmooth, gathers }: FramePace,
  ): void {
    const { renderer, specimenScene, gazeFocus } = this;
    const { volumes, traced, panes, overlays, bounds, solids } = drawn;
    const marches = volumes?.marches ?? null;
    const specimen = specimenScene.specimen.group.matrixWorld;
    renderer.info.reset();
    specimenScene.aimLamps(head);
    specimenScene.isFlat = this.eyes.all.length === 1;
    this.both.prepare(specimenScene.scene, this.eyes.all.length > 1);
    this.cuts.sync(clip, specimen);
    this.cuts.open(drawn.openTile, specimen);
    this.aim(bounds, resolution);
    this.marchFrame.uIsCrossing.value = marches?.isInDisc ?? false;
    this.march.hide();
    this.marchWithin.hide();
    traced?.hide();
    const opaque = (blended = panes) =>
      this.depth.render(renderer, specimenScene.scene, this.eyes, [
        ...specimenScene.overlays,
        ...overlays,
        ...blended.map(({ scene }) => scene),
      ]);
    const tracer = traced?.isShown ? traced : null;
    const hasMarches = marches !== null && !marches.isEmpty;
    if (tracer !== null || hasMarches) opaque();
    const isMarched = hasMarches && !this.canSkipMarch(drawn, clip, isMoving);
    const isMixed =
      isMarched && tracer === null && gazeFocus.outer_rad > 0 && marches.isPartlyInDisc;
    if (isMarched) {
      const toSpecimen = this.toSpecimen.copy(specimen).invert();
      const eye = this.point.setFromMatrixPosition(head).applyMatrix4(toSpecimen);
      marches.placeAs(specimen);
      const axes = specimenScene.lampAxes(head);
      const lamp = this.lamp.set(...specimenScene.light.key.towards).transformDirection(axes);
      lamp.transformDirection(toSpecimen);
      const toEye = this.toEye.copy(head).invert().multiply(axes);
      if (tracer === null) lightByScene(this.marchFrame, specimenScene.light, toEye);
      else tracer.lightMarch(this.marchFrame, specimen, head);
      const { apex_um: apex, axis_um: axis } = gazeFocus;
      volumes?.aim({ eye, apex, axis, clip: this.cuts.march, lamp });
      this.shiftNoise(isMoving, gathers);
      const marchBy = (pass: MarchPass, blended = panes) => {
        const hasPane = blended.some(({ isPane }) => isPane);
        this.marchFrame.uHasPane.value = hasPane;
        if (hasPane) this.depth.renderPanes(renderer, specimenScene.scene, this.eyes);
        pass.render(marches.scene, this.eyes, resolution, gathers);
      };
      if (isMixed) {
        this.marchFrame.uDisc.value.set(...EVERYWHERE);
        marches.endAtDisc(true);
        marchBy(this.marchWithin);
        renderer.setRenderTarget(this.drawInto(this.within));
        this.marchWithin.hide();
        marches.endAtDisc(false);
        this.marchFrame.uDisc.value.set(...NOWHERE);
        const translucent = panes.filter(({ isSolid }) => !isSolid);
        opaque(translucent); // beyond the disc the other surfaces are opaque
        marchBy(this.march, translucent);
      } else {
        this.within.setSize(1, 1); // frees its memory: it is as large as the frame
        marchBy(this.march);
      }
    }
    if (tracer !== null) {
      const scene = { specimen, clip: this.cuts.march, bounds, solids };
      const standIn = isMarched || this.standInKey !== "" ? this.march.marched : null;
      tracer.render(renderer, this.eyes, scene, { resolution, isMoving, passes, standIn });
      if (tracer.isOnScreen) this.march.hide();
    }
    const isSmoothed = isSmooth && hasEdges(specimenScene.scene);
    this.show(isSmoothed ? this.light : this.draft, isMixed);
  }

  /** Whether the user's own room is visible behind the specimen. */
  set isSeeThrough(is: boolean) {
    this.specimenScene.isSeeThrough = is;
    this.encode.isSeeThrough = is;
  }

  /** Whether another frame of the view at rest would improve the march's image. */
  get canGather(): boolean {
    return this.march.isShown && this.march.gathered < MAX_GATHERED;
  }

  /**
   * Whether the stand-in march for the path tracing can be skipped, because the view is at rest and
   * the last march is still valid. In a headset, whose view never rests, a march is drawn until the
   * path tracing has its first image.
   */
  private canSkipMarch({ volumes, traced, solids }: Drawn, clip: Clip, isMoving: boolean): boolean {
    if (!traced?.isShown) return false;
    const isWorn = this.eyes.all.length > 1;
    if (isWorn && traced.standsAlone) {
      this.standInKey = "";
      return true;
    }
    const standInKey = isMoving ? "" : JSON.stringify([volumes?.marchKey, clip, solids]);
    const isSame = standInKey !== "" && standInKey === this.standInKey;
    this.standInKey = standInKey;
    return isSame;
  }

  /**
   * Shifts the noise of the march from frame to frame; at rest the sequence starts from the same
   * value.
   */
  private shiftNoise(isMoving: boolean, gathers: boolean): void {
    const { uPhase, uSteps } = this.marchFrame;
    if (gathers) uSteps.value = REST_STEPS;
    if (isMoving) this.moved++;
    const turns = isMoving ? this.moved : gathers ? this.march.gathered : 0;
    uPhase.value = (turns * GOLDEN) % 1;
  }

  private aim({ min, max }: Bounds, resolution: number): void {
    const { gazeFocus, cone, marchFrame, specimenScene } = this;
    cone.uApex.value.copy(gazeFocus.apex);
    cone.uAxis.value.copy(gazeFocus.axis);
    const middle = this.point
      .set(...max)
      .add(this.corner.set(...min))
      .multiplyScalar(0.5);
    cone.uRim.value = middle
      .applyMatrix4(specimenScene.specimen.group.matrixWorld)
      .distanceTo(gazeFocus.apex);
    marchFrame.uDisc.value.set(...gazeFocus.cosines);
    const [eye] = this.eyes.all;
    const pixel_rad =
      eye === undefined ? 0 : 2 / (eye.camera.projectionMatrix.elements[5] * eye.viewport.w);
    marchFrame.uReach.value = gazeFocus.reach((MIXED_PX * pixel_rad) / resolution);
  }

  /**
   * Draws the scene's light and encodes it for the current target.
   * @param isMixed whether the frame inside the disc is mixed in
   */
  private show(light: WebGLRenderTarget, isMixed: boolean): void {
    const { renderer, eyes, gazeFocus, marchFrame, fade } = this;
    fade.keep(this.last);
    this.last = light;
    const before = this.drawInto(light);
    if (isMixed) {
      marchFrame.uDisc.value.set(...gazeFocus.cosines);
      this.overWithin.show(eyes, 1);
      const { autoClear } = renderer;
      renderer.autoClear = false;
      drawWhole(renderer, this.mixed, light, eyes.width_px, eyes.height_px);
      renderer.autoClear = autoClear;
    }
    this.encode.mix(fade.texture, fade.shareIn(light));
    this.encode.render(renderer, light, before);
  }

  /** Draws the scene's light. Returns the render target that was set before. */
  private drawInto(light: WebGLRenderTarget): WebGLRenderTarget | null {
    const { renderer, eyes, both } = this;
    const before = renderer.getRenderTarget();
    const { enabled } = renderer.xr; // otherwise three.js would draw the headset's eyes itself
    light.setSize(eyes.width_px, eyes.height_px);
    renderer.xr.enabled = false;
    renderer.setRenderTarget(light);
    renderer.render(this.specimenScene.scene, both.cameraOf(eyes));
    renderer.xr.enabled = enabled;
    return before;
  }

  /** Depth of the opaque objects in this frame. */
  get sceneDepth(): { value: Texture } {
    return this.marchFrame.uSceneDepth;
  }

  add(overlay: Object3D): void {
    this.specimenScene.scene.add(overlay);
  }

  dispose(): void {
    this.depth.dispose();
    this.march.dispose();
    this.marchWithin.dispose();
    this.overWithin.dispose();
    this.within.dispose();
    this.light.dispose();
    this.draft.dispose();
    this.encode.dispose();
    this.fade.dispose();
    this.marchFrame.uNoise.value.dispose();
  }
}
