/** One frame: depth of the surfaces, volumes marched up to it, the scene, the volumes over it. */
import { type Camera, Matrix4, type Object3D, Vector3, type WebGLRenderer } from "three";
import type { Bounds } from "../bundle/generated/bundle";
import { Cuts } from "../gpu/clip_planes";
import { Eyes } from "../gpu/eyes";
import type { Clip } from "../math/clip";
import type { TracedVolume } from "../pathtrace/traced_volume";
import { makeSurfaceFrame } from "../surfaces/blend_material";
import { makeFrame } from "../volumes/tile_raymarch";
import type { VolumeSet } from "../volumes/volume_set";
import { DepthPass } from "./depth_pass";
import type { Hybrid } from "./gaze_focus";
import { MarchPass } from "./raymarch_pass";
import type { Room } from "./scene";

/** The things to draw. */
export type Drawn = Readonly<{
  volumes: VolumeSet;
  traced: TracedVolume;
  /** Surfaces that are not opaque now. */
  panes: readonly Object3D[];
  /** What else is not, besides the room's own. */
  overlays: readonly Object3D[];
  /** Of the specimen, um. */
  bounds: Bounds;
  /** A number that changes with the opaque surfaces. */
  solids: number;
}>;

/** Pixels of the volumes to one of the picture, 0..1; samples of each that are traced. */
export type FramePace = Readonly<{ resolution: number; isMoving: boolean; passes: number }>;

export class Picture {
  /** Where they are in this frame. */
  readonly eyes = new Eyes();
  private readonly cuts = new Cuts();
  private readonly depth = new DepthPass(this.cuts);
  /** The part of a frame that all volumes share. */
  readonly marchFrame = makeFrame(this.depth.texture, this.depth.paneTexture);
  /** The part of a frame that all surfaces share. */
  readonly surfaceFrame = makeSurfaceFrame(this.marchFrame.uDisc, this.cuts);
  private readonly march = new MarchPass(this.marchFrame);
  private readonly point = new Vector3();
  private readonly toSpecimen = new Matrix4();

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly room: Room,
    private readonly hybrid: Hybrid,
  ) {
    room.scene.add(...this.march.overlays);
  }

  /**
   * @param head its pose in the room
   * @param clip what is cut away
   * @param pace how much the frame's budget allows
   */
  draw(
    camera: Camera,
    head: Matrix4,
    { volumes, traced, panes, overlays, bounds, solids }: Drawn,
    clip: Clip,
    { resolution, isMoving, passes }: FramePace,
  ): void {
    const { renderer, room, hybrid } = this;
    const specimen = room.specimen.group.matrixWorld;
    renderer.info.reset();
    room.light(head);
    this.cuts.follow(clip, specimen);
    this.surfaceFrame.uApex.value.copy(hybrid.apex);
    this.surfaceFrame.uAxis.value.copy(hybrid.axis);
    this.surfaceFrame.uDisc.value.set(...hybrid.cosines);
    this.march.hide();
    traced.hide();
    if (traced.isShown) {
      this.depth.render(renderer, room.scene, this.eyes, [...room.overlays, ...overlays, ...panes]);
      const scene = { specimen, clip: this.cuts.march, bounds, solids };
      traced.render(renderer, this.eyes, scene, resolution, isMoving, passes);
    }
    if (!volumes.isEmpty) {
      const toSpecimen = this.toSpecimen.copy(specimen).invert();
      const eye = this.point.setFromMatrixPosition(head).applyMatrix4(toSpecimen);
      volumes.placeAs(specimen);
      volumes.aim(eye, hybrid.apex_um, hybrid.axis_um, this.cuts.march);
      this.depth.render(renderer, room.scene, this.eyes, [...room.overlays, ...overlays, ...panes]);
      this.marchFrame.uHasPane.value = panes.length > 0;
      if (panes.length > 0) this.depth.renderPanes(renderer, room.scene, this.eyes);
      this.march.render(renderer, volumes.scene, this.eyes, resolution);
    }
    renderer.render(room.scene, camera);
  }

  /** What is laid over the scene. */
  add(overlay: Object3D): void {
    this.room.scene.add(overlay);
  }

  dispose(): void {
    this.depth.dispose();
    this.march.dispose();
    this.marchFrame.uNoise.value.dispose();
  }
}
