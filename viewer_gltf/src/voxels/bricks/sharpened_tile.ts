/**
 * The volumes of one tile of a source that is not built: coarse volumes from files, then finer ones
 * as bricks, which the host makes from the source on request. It has the interface of
 * `TileTexture`.
 */
import type { Packed, TileTexture } from "../tile_texture";
import type { VolumeSource } from "../volume_source";
import type { BrickTile } from "./brick_atlas";

export class SharpenedTile {
  private finer: BrickTile | null = null;
  private isSharp = false;
  private isRefused = false;

  /**
   * @param make returns the finer volumes, before anything is loaded; null if there are none any
   *   more
   */
  constructor(
    private readonly coarse: TileTexture,
    private readonly make: (onRefused: () => void) => BrickTile | null,
    private readonly onChange: () => void,
  ) {}

  private get drawn(): TileTexture | BrickTile {
    return this.isSharp && this.finer !== null ? this.finer : this.coarse;
  }

  get shown(): Packed | null {
    return this.drawn.shown;
  }

  get old(): Packed | null {
    return this.drawn.old;
  }

  get fresh(): number {
    return this.drawn.fresh;
  }

  get isLoading(): boolean {
    return this.coarse.isLoading || this.isSharpening;
  }

  get isSharpening(): boolean {
    return this.finer?.isLoading === true;
  }

  /** Whether finer volumes may be requested now: they exist, and the coarse ones are shown. */
  get canSharpen(): boolean {
    const hasFiner = [...this.kept.values()].some(({ volume }) => volume.finer_size !== undefined);
    const isIdle = this.finer === null && !this.isRefused && !this.coarse.isLoading;
    return isIdle && hasFiner && this.coarse.shown !== null;
  }

  get bytes(): number {
    return this.coarse.bytes + (this.finer?.bytes ?? 0);
  }

  get kept(): ReadonlyMap<string, VolumeSource> {
    return this.coarse.kept;
  }

  /**
   * For each channel, an intensity, 0 to 255, or -1. The host leaves out bricks whose voxels are
   * all at or below it. A transfer function that shows such voxels therefore needs other bricks.
   */
  get thresholds(): readonly number[] {
    return this.isSharp ? (this.finer?.thresholds ?? []) : [];
  }

  hasFailed(channel: string): boolean {
    return this.coarse.hasFailed(channel);
  }

  retryFailed(): void {
    this.coarse.retryFailed();
  }

  /**
   * Loads these channels and mip levels of the coarse volumes. If the channels changed, no finer
   * volume is loaded yet.
   */
  want(sources: ReadonlyMap<string, VolumeSource>, levels: readonly number[], finest = 0): void {
    const names = [...sources.keys()];
    const isSame = names.join() === [...this.kept.keys()].join();
    if (!isSame && sources.size > 0) {
      this.dropFiner();
      this.isRefused = false;
    }
    this.coarse.want(sources, levels, finest);
  }

  sharpen(): void {
    this.finer = this.make(() => this.showCoarse());
    if (this.finer === null) this.isRefused = true;
    else this.finer.want(this.kept);
  }

  /** Draws the coarse volumes from now on, until other channels are wanted. */
  showCoarse(): void {
    this.isRefused = true;
    this.dropFiner();
    this.onChange();
  }

  advance(dt_s: number): boolean {
    const isFading = this.coarse.advance(dt_s);
    const isStale = this.finer?.advance(dt_s) === true;
    // The coarse volumes are drawn until all bricks for the view are loaded, since the first bricks
    // are coarser.
    if (!this.isSharp && this.finer?.isComplete === true) {
      this.isSharp = true;
      this.onChange();
    }
    return isFading || isStale;
  }

  private dropFiner(): void {
    this.finer?.dispose();
    this.finer = null;
    this.isSharp = false;
  }

  dispose(): void {
    this.dropFiner();
    this.coarse.dispose();
  }
}
