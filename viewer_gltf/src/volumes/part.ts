/** The part of the viewer for the channels' volumes: which are shown, and their ray march. */
import { type Matrix4, Vector3 } from "three";
import { memoryBudget } from "../gpu/memory_budget";
import type { Form, StreamView } from "../host/form";
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { Vec3 } from "../math/vec3";
import type { PartSection } from "../panel/controls";
import { discLimit } from "../state/focus_tiles";
import { wantedTiles, wantsSurface } from "../state/representation";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { BrickService } from "../voxels/bricks/brick_service";
import type { BrickView } from "../voxels/bricks/protocol";
import type { VolumeLimits } from "../voxels/mip_levels";
import { VOLUME_KEYS } from "./keys";
import { volumeSections } from "./section";
import { VolumeSet } from "./volume_set";

class VolumesPart implements Part, Form {
  readonly id = "volumes";
  readonly form = this;
  readonly services;
  readonly marched: VolumeSet;
  /** Streams bricks from a host; null if volumes are files. */
  private readonly bricks: BrickService | null;

  constructor(private readonly host: PartHost) {
    const { bundle } = host;
    const onChange = () => host.display.requestFrame();
    const onError = (error: unknown) => host.report(error);
    const limits = limitsOf(host.canvas);
    this.bricks =
      bundle.bricks === undefined
        ? null
        : new BrickService(host.display.renderer, bundle.bricks, onChange, onError);
    const { marchFrame } = host.frame;
    this.marched = new VolumeSet(bundle, marchFrame, limits, onChange, onError, this.bricks);
    this.services = { volumes: this.marched, texels: { limits, bricks: this.bricks } };
  }

  sync(state: ViewerState): void {
    const { focusTiles, mayRefine, hasOverview } = this.host.focus;
    this.marched.sync(state, hasOverview ? wantedTiles(state, focusTiles) : [], mayRefine);
  }

  panel(): readonly PartSection[] {
    const { state, focus } = this.host;
    return volumeSections(state, discLimit(focus.focusTiles, state.discRadius_deg));
  }

  get isLoading(): boolean {
    return this.marched.isLoading;
  }

  get isIncomplete(): boolean {
    return this.marched.isIncomplete;
  }

  outline(state: ViewerState, channel: ChannelState): readonly Vec3[] | null | undefined {
    return wantsSurface(state, channel) ? undefined : this.marched.outline(channel.id);
  }

  limitEdge(edge: number): void {
    this.marched.limitEdge(edge);
  }

  forget(): void {
    this.marched.forget();
  }

  fade(fade_s: number): boolean {
    return this.marched.advance(fade_s);
  }

  stream(view: StreamView): void {
    if (this.bricks === null) return;
    const looked = viewOf(view, this.host.viewpoint.specimen);
    this.marched.sharpen(looked);
    this.bricks.look(looked);
  }

  retryFailed(): void {
    this.marched.retryFailed();
  }

  dispose(): void {
    this.marched.dispose();
    this.bricks?.dispose();
  }
}

/**
 * The view of a camera, in um.
 * @param specimen matrix from um to the scene
 */
function viewOf({ camera, height_px }: StreamView, specimen: Matrix4): BrickView {
  const { projectionMatrix, matrixWorld, matrixWorldInverse } = camera;
  const clip = projectionMatrix.clone().multiply(matrixWorldInverse).multiply(specimen);
  const toSpecimen = specimen.clone().invert();
  const eye = new Vector3().setFromMatrixPosition(matrixWorld).applyMatrix4(toSpecimen);
  const ahead = new Vector3(0, 0, -1).transformDirection(matrixWorld);
  return {
    clip: clip.toArray(),
    eye: eye.toArray(),
    gaze: ahead.transformDirection(toSpecimen).toArray(),
    pixels_per_radian: (projectionMatrix.elements[5] * height_px) / 2,
  };
}

function limitsOf(canvas: HTMLCanvasElement): VolumeLimits {
  const gl = canvas.getContext("webgl2");
  if (gl === null) throw new Error("the canvas has no WebGL 2 context");
  const side: number = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE);
  return { bytes: memoryBudget(navigator).volumes, side, edge: Number.POSITIVE_INFINITY };
}

export const volumes: PartDefinition = {
  id: "volumes",
  rank: 10,
  keys: VOLUME_KEYS,
  create: (host) => new VolumesPart(host),
};
