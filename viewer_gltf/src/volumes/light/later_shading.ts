/** The shading of volumes. Its code is loaded with the first shaded volumes. */
import type { Vector3 } from "three";
import type { MarchClip } from "../../gpu/clip_uniforms";
import type { MarchFrame } from "../../voxels/march_frame";
import type { TileMarch } from "../tile_raymarch";
import { CoarseTexels } from "./coarse_texels";
import type { DepthShading, Marched } from "./depth_shading";

export class LaterShading {
  private shading: DepthShading | null = null;
  private code: "none" | "coming" | "there" | "failed" = "none";

  constructor(
    private readonly frame: MarchFrame,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  get isLoading(): boolean {
    return this.code === "coming" || this.shading?.isLoading === true;
  }

  /**
   * Shades the marched volumes.
   *
   * @param strength 0 turns the shading off
   * @param lamp direction to the lamp in the world
   */
  sync(drawn: readonly Marched[], strength: number, clip: MarchClip, lamp: Vector3): void {
    if (strength > 0 && drawn.length > 0 && this.code === "none") void this.load();
    this.shading?.set(strength);
    this.shading?.sync(drawn, clip, lamp);
  }

  private async load(): Promise<void> {
    const { frame, onChange, onError } = this;
    this.code = "coming";
    try {
      const { DepthShading } = await import("./depth_shading");
      const coarse = new CoarseTexels(onChange, onError);
      this.shading = new DepthShading(frame, coarse, onChange, onError);
      this.code = "there";
    } catch (error) {
      this.code = "failed"; // volumes are drawn without shading
      onError(error);
    }
    onChange();
  }

  place(march: TileMarch): void {
    this.shading?.place(march);
  }

  /** Forgets the volumes after their GPU resources were released. */
  forget(): void {
    this.shading?.forget();
  }

  dispose(): void {
    this.shading?.dispose();
  }
}
