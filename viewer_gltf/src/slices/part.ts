/** The part of the viewer for slices. Most of its code loads when they are first shown. */
import { Object3D } from "three";
import { TemporaryError } from "../bundle/errors";
import type { FrameView, Hit, Part, PartDefinition, PartHost, PartScene } from "../host/part";
import type { ClipPlane } from "../math/clip";
import type { Ray, Vec3 } from "../math/vec3";
import type { PartSection } from "../panel/controls";
import { tileAt, unitRay } from "../probe/probe";
import type { ViewerState } from "../state/viewer_state";
import { SLICE_KEYS } from "./keys";
import { sliceSections } from "./section";
import { isSliced, SLICE_SETTINGS, SLICE_WAYS } from "./settings";
import { hitSlices } from "./slice_frame";
import type { Slices } from "./slices";

const NOT_LOADED =
  "The part of the page that shows slices could not be loaded. Check the connection and try again.";

class SlicesPart implements Part {
  readonly id = "slices";
  private readonly group = new Object3D();
  private slices: Slices | null = null;
  private coming: Promise<void> | null = null;
  /** The newest state that shows slices, for when the code has loaded. */
  private wanted: ViewerState | null = null;
  /** Whether the code could not be loaded, and no retry has been requested since. */
  private hasFailed = false;
  private isDisposed = false;

  constructor(private readonly host: PartHost) {}

  sync(state: ViewerState): void {
    if (this.slices !== null) this.slices.sync(state);
    else if (isSliced(state) && !this.hasFailed) {
      this.wanted = state;
      this.coming ??= this.load();
    }
  }

  private async load(): Promise<void> {
    const { bundle, view, display, values } = this.host;
    const volumes = this.host.service("volumes");
    try {
      const { Slices } = await import("./slices").catch((cause) => {
        throw new TemporaryError(NOT_LOADED, { cause });
      });
      if (this.isDisposed || this.wanted === null) return;
      this.slices = new Slices({
        ...{ manifest: bundle.manifest, base: bundle.base, view, state: this.wanted },
        values,
        sourceOf: async (tile, channel) => (await volumes?.sourceOf(tile, channel)) ?? null,
        dispatch: (action) => this.host.dispatch(action),
        onChange: () => display.requestFrame(),
        onError: (error) => this.host.report(error),
      });
      this.group.add(this.slices.planes.group);
      this.slices.sync(this.wanted);
      display.requestFrame();
    } catch (error) {
      this.hasFailed = true;
      this.host.report(error);
    } finally {
      this.coming = null;
    }
  }

  get isLoading(): boolean {
    return this.coming !== null || this.slices?.images.isLoading === true;
  }

  get scene(): PartScene {
    const { group } = this;
    const planes = this.slices?.planes;
    if (planes === undefined) return { group, overlays: [], solid: 0, isStanding: false };
    const { marks, solid } = planes;
    return { group, overlays: [marks], solid, isStanding: planes.group.visible };
  }

  /** Returns the corner in front of the slices, which would hide them. */
  cutBefore(eye: Vec3): readonly ClipPlane[] | undefined {
    return this.slices?.planes.cornerTowards(eye);
  }

  pick(ray: Ray): Hit | null {
    const { planes, images } = this.slices ?? {};
    if (planes?.group.visible !== true || images?.frames == null) return null;
    const found = hitSlices(unitRay(ray), images.frames, images.box);
    if (found === null) return null;
    const { point, distance } = found;
    const tile = tileAt(this.host.bundle.manifest, point);
    return { point, tile, channel: null, distance_um: distance };
  }

  /** The slices are the first section for a patient on a flat screen. */
  panel(): readonly PartSection[] {
    const { state, isInStereo, bundle } = this.host;
    const isFirst = bundle.manifest.specimen.sides !== undefined && !isInStereo;
    return sliceSections(state, this.values, isFirst);
  }

  /** The channels' values where the slices meet, in the source's units; empty if no slices are shown. */
  private get values(): readonly string[] {
    const images = this.slices?.images ?? null;
    return images === null || images.frames === null ? [] : images.valuesAt(images.point);
  }

  advance({ eyeView }: FrameView): void {
    this.slices?.update(eyeView);
  }

  retryFailed(): void {
    this.hasFailed = false;
    this.slices?.images.retryFailed();
  }

  dispose(): void {
    this.isDisposed = true;
    this.slices?.dispose();
  }
}

export const slices: PartDefinition = {
  id: "slices",
  keys: SLICE_KEYS,
  settings: SLICE_SETTINGS,
  remedies: SLICE_WAYS,
  create: (host) => new SlicesPart(host),
};
