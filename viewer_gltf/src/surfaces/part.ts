/** The part of the viewer for the channels' surfaces. */
import { memoryBudget } from "../gpu/memory_budget";
import type { Form, StreamView } from "../host/form";
import type { Part, PartDefinition, PartHost, PartScene } from "../host/part";
import type { Vec3 } from "../math/vec3";
import type { BlendedScene } from "../render/blend_material";
import type { Progress } from "../state/overview_progress";
import { wantsSurface } from "../state/representation";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { SurfaceLoader } from "./gltf_loader";
import { SurfaceSet } from "./surface_set";

class SurfacesPart implements Part, Form {
  readonly id = "surfaces";
  readonly form = this;
  readonly services;
  private readonly loader: SurfaceLoader;
  private readonly set: SurfaceSet;

  constructor(private readonly host: PartHost) {
    this.loader = new SurfaceLoader(host.display.renderer);
    this.set = new SurfaceSet(host.bundle, {
      loader: this.loader,
      frame: host.frame.surfaceFrame,
      budget: memoryBudget(navigator),
      presence: (tile, channel) => host.service("volumes")?.presence(tile, channel) ?? 0,
      isCrossing: () => host.service("volumes")?.isInDisc ?? false,
      onChange: () => host.display.requestFrame(),
      onError: (error) => host.report(error),
    });
    this.services = { surfaces: this.set };
  }

  get scene(): PartScene {
    const { group } = this.set;
    return { group, overlays: [], solid: 0, isStanding: false };
  }

  sync(state: ViewerState): void {
    this.set.sync(state, this.host.focus.focusTiles);
  }

  get isLoading(): boolean {
    return this.set.isLoading || !this.set.overview.isComplete;
  }

  get overview(): Progress {
    return this.set.overview;
  }

  get hasFirst(): boolean {
    return this.set.hasFirst;
  }

  get triangles(): number {
    return this.set.triangles;
  }

  get panes(): readonly BlendedScene[] {
    return this.set.blended;
  }

  outline(state: ViewerState, channel: ChannelState): readonly Vec3[] | null | undefined {
    return wantsSurface(state, channel) ? this.set.outline(channel.id) : undefined;
  }

  stream({ camera, width_px, height_px, error_px }: StreamView): void {
    this.set.setErrorTarget(error_px);
    this.set.update(camera, width_px, height_px);
  }

  updateMaterials(): void {
    this.set.applyAllStyles();
  }

  retryFailed(): void {
    this.set.retryFailed();
  }

  dispose(): void {
    this.set.dispose();
    this.loader.dispose();
  }
}

export const surfaces: PartDefinition = {
  id: "surfaces",
  rank: 30,
  create: (host) => new SurfacesPart(host),
};
