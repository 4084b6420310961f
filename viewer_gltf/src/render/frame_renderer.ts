/**
 * One frame: depth of the surfaces, volumes marched up to it, the scene, the volumes over it. All of
 * it is linear light until the end, when it is encoded once.
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
import { linearTarget } from "../gpu/linear_target";
import type { Clip } from "../math/clip";
import { lightByRoom, makeFrame, REST_STEPS } from "../voxels/march_frame";
import { type BlendedScene, makeSurfaceFrame, type SurfaceFrame } from "./blend_material";
import { CrossFade } from "./cross_fade";
import { DepthPass } from "./depth_pass";
import type { MarchedVolumes, TracedVolumes } from "./drawn_forms";
import type { Hybrid } from "./gaze_focus";
import { MarchPass } from "./raymarch_pass";
import type { Room } from "./scene";

/** The things to draw. */
export type Drawn = Readonly<{
  /** null: no part draws volumes. */
  volumes: MarchedVolumes | null;
  /** null: no part traces paths of light. */
  traced: TracedVolumes | null;
  /** Surfaces that are not opaque now. */
  panes: readonly BlendedScene[];
  /** Other objects that are not opaque, besides those of the scene itself. */
  overlays: readonly Object3D[];
  /** The box of the specimen, um. */
  bounds: Bounds;
  /** The tile that is drawn as a volume among surfaces, um; null: there is none. */
  openTile: Bounds | null;
  /** A number that changes with the opaque surfaces. */
  solids: number;
}>;

/** Pixels of the volumes to one of the picture, 0..1; samples of each that are traced. */
export type FramePace = Readonly<{
  resolution: number;
  isMoving: boolean;
  passes: number;
  /** Whether edges are smoothed: it costs a third of a frame of surfaces where software draws. */
  isSmooth: boolean;
  /** Whether nothing has changed since the last frame: the march is averaged with those before. */
  gathers: boolean;
}>;

/** Cosines of a disc that is all of the picture, and of one that is nowhere. */
const EVERYWHERE = [-2, -3] as const;
const NOWHERE = [3, 2] as const;
/** Most frames of a view at rest that are averaged. */
const MAX_GATHERED = 64;
/** Multiples of it fill 0..1 evenly, however many there are. */
const GOLDEN = (Math.sqrt(5) - 1) / 2;
/** Pixels of the march beyond the disc that those within it mix. */
const MIXED_PX = 2;

export class FrameRenderer {
  /** Where they are in this frame. */
  readonly eyes = new Eyes();
  private readonly both = new BothEyes();
  private readonly cuts = new Cuts();
  private readonly depth = new DepthPass(this.cuts, this.both);
  /** The part of a frame that all volumes share. */
  readonly marchFrame = makeFrame(this.depth.texture, this.depth.paneTexture);
  /** The part of a frame that all surfaces share. */
  readonly surfaceFrame: SurfaceFrame;
  private readonly march: MarchPass;
  /** The disc's cone in the room, m. */
  private readonly cone = {
    uApex: { value: new Vector3() },
    uAxis: { value: new Vector3(0, 0, -1) },
    uRim: { value: 1 },
  };
  /** All that is drawn, before it is encoded. */
  private readonly light: WebGLRenderTarget;
  /** The same where edges aren't smoothed. */
  private readonly draft: WebGLRenderTarget;
  private readonly encode = new EncodePass();
  /** Fades from the picture before a jump to the one after it. */
  readonly fade: CrossFade;
  /** The target of the last picture. */
  private last: WebGLRenderTarget | null = null;
  /** Where a channel is a volume beyond the disc too: the picture within it, and its march. */
  private readonly within: WebGLRenderTarget;
  private readonly marchWithin: MarchPass;
  private readonly overWithin: Overlay;
  private readonly mixed = new Scene();
  /** Frames of moving views. */
  private moved = 0;
  /** The volumes of the march that stands in for what is traced; "": it has to be made. */
  private stoodIn = "";
  private readonly point = new Vector3();
  private readonly lamp = new Vector3();
  private readonly corner = new Vector3();
  private readonly toSpecimen = new Matrix4();
  private readonly toEye = new Matrix4();

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly room: Room,
    private readonly hybrid: Hybrid,
  ) {
    const { uDisc, uIsCrossing } = this.marchFrame;
    const disc = { ...this.cone, uDisc, uIsCrossing };
    this.march = new MarchPass(renderer, this.marchFrame, disc);
    this.surfaceFrame = makeSurfaceFrame(disc, this.march.picture, this.cuts, this.both);
    this.light = linearTarget(renderer, { hasDepth: true, isMultisampled: true });
    this.draft = linearTarget(renderer, { hasDepth: true });
    this.fade = new CrossFade(renderer);
    this.within = linearTarget(renderer, { hasDepth: true, isMultisampled: true });
    this.marchWithin = new MarchPass(renderer, this.marchFrame);
    const { uSceneDepth } = this.marchFrame;
    const whole = { ...disc, uIsCrossing: { value: true } };
    this.overWithin = new Overlay(this.within.texture, uSceneDepth, { order: LAST, disc: whole });
    this.mixed.add(this.overWithin.mesh);
    room.scene.add(...this.march.overlays, ...this.marchWithin.overlays);
  }

  /**
   * @param head its pose in the room
   * @param clip what is cut away
   * @param pace how much the frame's budget allows
   */
  draw(
    head: Matrix4,
    drawn: Drawn,
    clip: Clip,
    { resolution, isMoving, passes, isSmooth, gathers }: FramePace,
  ): void {
    const { renderer, room, hybrid } = this;
    const { volumes, traced, panes, overlays, bounds, solids } = drawn;
    const marches = volumes?.marches ?? null;
    const specimen = room.specimen.group.matrixWorld;
    renderer.info.reset();
    room.aimLamps(head);
    room.isFlat = this.eyes.all.length === 1;
    this.both.takeIn(room.scene);
    this.cuts.follow(clip, specimen);
    this.cuts.open(drawn.openTile, specimen);
    this.aim(bounds, resolution);
    this.marchFrame.uIsCrossing.value = marches?.isInDisc ?? false;
    this.march.hide();
    this.marchWithin.hide();
    traced?.hide();
    const opaque = (blended = panes) =>
      this.depth.render(renderer, room.scene, this.eyes, [
        ...room.overlays,
        ...overlays,
        ...blended.map(({ scene }) => scene),
      ]);
    const tracer = traced?.isShown ? traced : null;
    const hasMarches = marches !== null && !marches.isEmpty;
    if (tracer !== null || hasMarches) opaque();
    const isMarched = hasMarches && !this.needsNoMarch(drawn, clip, isMoving);
    const isMixed = isMarched && tracer === null && hybrid.outer_rad > 0 && marches.isPartlyInDisc;
    if (isMarched) {
      const toSpecimen = this.toSpecimen.copy(specimen).invert();
      const eye = this.point.setFromMatrixPosition(head).applyMatrix4(toSpecimen);
      marches.placeAs(specimen);
      const axes = room.lampAxes(head);
      const lamp = this.lamp.set(...room.light.key.towards).transformDirection(axes);
      lamp.transformDirection(toSpecimen);
      const toEye = this.toEye.copy(head).invert().multiply(axes);
      if (tracer === null) lightByRoom(this.marchFrame, room.light, toEye);
      else tracer.lightMarch(this.marchFrame, specimen, head);
      const { apex_um: apex, axis_um: axis } = hybrid;
      volumes?.aim({ eye, apex, axis, clip: this.cuts.march, lamp });
      this.shiftNoise(isMoving, gathers);
      const marchBy = (pass: MarchPass, blended = panes) => {
        const hasPane = blended.some(({ isPane }) => isPane);
        this.marchFrame.uHasPane.value = hasPane;
        if (hasPane) this.depth.renderPanes(renderer, room.scene, this.eyes);
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
        opaque(translucent); // beyond the disc the others are whole
        marchBy(this.march, translucent);
      } else {
        this.within.setSize(1, 1); // it is as large as the picture
        marchBy(this.march);
      }
    }
    if (tracer !== null) {
      const scene = { specimen, clip: this.cuts.march, bounds, solids };
      const standIn = isMarched || this.stoodIn !== "" ? this.march.marched : null;
      tracer.render(renderer, this.eyes, scene, { resolution, isMoving, passes, standIn });
      if (tracer.isOnScreen) this.march.hide();
    }
    this.show(isSmooth ? this.light : this.draft, isMixed);
  }

  /** Whether the user's own room shows behind. */
  set isSeeThrough(is: boolean) {
    this.room.isSeeThrough = is;
    this.encode.isSeeThrough = is;
  }

  /** Whether another frame of the view at rest would make the march's picture better. */
  get canGather(): boolean {
    return this.march.isShown && this.march.gathered < MAX_GATHERED;
  }

  /**
   * Whether the march need not stand in for what is traced, or what was marched last still does: the view is
   * at rest. Before a head, which never rests, it does until the first traced picture.
   */
  private needsNoMarch({ volumes, traced, solids }: Drawn, clip: Clip, isMoving: boolean): boolean {
    if (!traced?.isShown) return false;
    const isWorn = this.eyes.all.length > 1;
    if (isWorn && traced.standsAlone) {
      this.stoodIn = "";
      return true;
    }
    const stoodIn = isMoving ? "" : JSON.stringify([volumes?.marchKey, clip, solids]);
    const isSame = stoodIn !== "" && stoodIn === this.stoodIn;
    this.stoodIn = stoodIn;
    return isSame;
  }

  /** The grain of the march differs from frame to frame; at rest frames begin with the same. */
  private shiftNoise(isMoving: boolean, gathers: boolean): void {
    const { uPhase, uSteps } = this.marchFrame;
    if (gathers) uSteps.value = REST_STEPS;
    if (isMoving) this.moved++;
    const turns = isMoving ? this.moved : gathers ? this.march.gathered : 0;
    uPhase.value = (turns * GOLDEN) % 1;
  }

  /** Bring the disc's cone to the gaze. */
  private aim({ min, max }: Bounds, resolution: number): void {
    const { hybrid, cone, marchFrame, room } = this;
    cone.uApex.value.copy(hybrid.apex);
    cone.uAxis.value.copy(hybrid.axis);
    const middle = this.point
      .set(...max)
      .add(this.corner.set(...min))
      .multiplyScalar(0.5);
    cone.uRim.value = middle.applyMatrix4(room.specimen.group.matrixWorld).distanceTo(hybrid.apex);
    marchFrame.uDisc.value.set(...hybrid.cosines);
    const [eye] = this.eyes.all;
    const pixel_rad =
      eye === undefined ? 0 : 2 / (eye.camera.projectionMatrix.elements[5] * eye.viewport.w);
    marchFrame.uReach.value = hybrid.reach((MIXED_PX * pixel_rad) / resolution);
  }

  /** Draw the room's light, and encode it for the present target; `isMixed`: with that within the disc. */
  private show(light: WebGLRenderTarget, isMixed: boolean): void {
    const { renderer, eyes, hybrid, marchFrame, fade } = this;
    fade.keep(this.last);
    this.last = light;
    const before = this.drawInto(light);
    if (isMixed) {
      marchFrame.uDisc.value.set(...hybrid.cosines);
      this.overWithin.show(eyes, 1);
      const { autoClear } = renderer;
      renderer.autoClear = false;
      drawWhole(renderer, this.mixed, light, eyes.width_px, eyes.height_px);
      renderer.autoClear = autoClear;
    }
    this.encode.mix(fade.texture, fade.shareIn(light));
    this.encode.render(renderer, light, before);
  }

  /** Draw the room's light; the target before. */
  private drawInto(light: WebGLRenderTarget): WebGLRenderTarget | null {
    const { renderer, eyes, both } = this;
    const before = renderer.getRenderTarget();
    const { enabled } = renderer.xr; // else three would draw the headset's eyes by itself
    light.setSize(eyes.width_px, eyes.height_px);
    renderer.xr.enabled = false;
    renderer.setRenderTarget(light);
    renderer.render(this.room.scene, both.cameraOf(eyes));
    renderer.xr.enabled = enabled;
    return before;
  }

  /** Depth of what is opaque in this frame. */
  get sceneDepth(): { value: Texture } {
    return this.marchFrame.uSceneDepth;
  }

  /** What is laid over the scene. */
  add(overlay: Object3D): void {
    this.room.scene.add(overlay);
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
