/** Depth shading, whose code loads with the first volumes that are shaded. */
import type { Vector3 } from "three";
import type { MarchClip } from "../../gpu/clip_uniforms";
import { canBeShaded } from "../../state/parameters/volumes";
import type { ViewerState } from "../../state/viewer_state";
import type { MarchFrame, TileMarch } from "../tile_raymarch";
import { CoarseTexels } from "./coarse_texels";
import type { DepthShading, Marched } from "./depth_shading";

export class LazyShading {
  private shading: DepthShading | null = null;
  private stage: "none" | "coming" | "there" | "failed" = "none";

  constructor(
    private readonly frame: MarchFrame,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  get isLoading(): boolean {
    return this.stage === "coming" || this.shading?.isLoading === true;
  }

  /** Shades the tiles that are drawn. `lamp`: the direction towards it. */
  follow(
    state: ViewerState | null,
    drawn: readonly Marched[],
    clip: MarchClip,
    lamp: Vector3,
  ): void {
    const strength = state !== null && canBeShaded(state) ? state.depthShading : 0;
    if (strength > 0 && drawn.length > 0 && this.stage === "none") void this.load();
    this.shading?.set(strength);
    this.shading?.follow(drawn, clip, lamp);
  }

  private async load(): Promise<void> {
    const { frame, onChange, onError } = this;
    this.stage = "coming";
    try {
      const { DepthShading } = await import("./depth_shading");
      const texels = new CoarseTexels(onChange, onError);
      this.shading = new DepthShading(frame, texels, onChange, onError);
      this.stage = "there";
    } catch (error) {
      this.stage = "failed"; // volumes are drawn without
      onError(error);
    } finally {
      onChange();
    }
  }

  place(march: TileMarch): void {
    this.shading?.place(march);
  }

  forget(): void {
    this.shading?.forget();
  }

  dispose(): void {
    this.shading?.dispose();
  }
}
