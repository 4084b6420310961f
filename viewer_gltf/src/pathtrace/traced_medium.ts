/** Provides the texels for path tracing, from a host that sends bricks for the current view, or from files. */
import type { ShownVolume } from "../state/on_screen";
import type { BrickTile } from "../voxels/bricks/brick_atlas";
import type { BrickService } from "../voxels/bricks/brick_service";
import { showsBelow } from "../voxels/bricks/shows_below";
import type { Appearance } from "../voxels/march_tables";
import type { VolumeLimits } from "../voxels/mip_levels";
import type { Packed } from "../voxels/tile_texture";
import { type VolumeSource, volumeOfBricks } from "../voxels/volume_source";
import { type ChannelSources, MediumLoader, type MediumTexels, withVolumes } from "./medium_loader";
import { frameOf } from "./texel_frame";

/** The channels and tiles whose texels are requested. */
export type MediumRequest = Readonly<{ channels: readonly string[]; tiles: readonly string[] }>;

export type MediumHandlers = Readonly<{
  /** Called when new texels have loaded, which replace the previous ones. */
  onTexels: (texels: MediumTexels) => void;
  /** Called when bricks can't be used, so that the caller has to request everything again, now from files. */
  onRefused: () => void;
  onChange: () => void;
  onError: (error: unknown) => void;
}>;

export class TracedMedium {
  private readonly loader = new MediumLoader();
  /** The volumes of the channels of the last request; empty until they are known. */
  sources: readonly ChannelSources[] = [];
  private loading: AbortController | null = null;
  /** The streamed tile; null: texels are loaded from files. */
  private brickTile: BrickTile | null = null;
  private packed: Packed | null = null;

  constructor(
    private readonly sourcesOf: (
      channel: string,
    ) => Promise<ReadonlyMap<string, VolumeSource> | null>,
    private readonly bricks: BrickService | null,
    private readonly handlers: MediumHandlers,
  ) {}

  get isLoading(): boolean {
    return this.loading !== null || this.brickTile?.isLoading === true;
  }

  /**
   * Returns the traced volumes, for a caller that reads values at a point.
   *
   * @param isolated ID of the only shown tile; null: all tiles are shown
   */
  shown(tableOf: (channel: string) => Uint8Array, isolated: string | null): readonly ShownVolume[] {
    return this.sources.flatMap(({ id, tiles }) => {
      const table = tableOf(id);
      return [...tiles].flatMap(([tile, source]) =>
        isolated !== null && tile !== isolated
          ? []
          : [{ tile, channel: id, source, table, isInDisc: false }],
      );
    });
  }

  async load({ channels, tiles }: MediumRequest, limits: VolumeLimits): Promise<void> {
    const abort = new AbortController();
    const { onTexels, onError, onChange } = this.handlers;
    this.loading = abort;
    try {
      const found = await Promise.all(
        channels.map(async (id) => ({ id, tiles: await this.sourcesOf(id) })),
      );
      if (abort.signal.aborted) return;
      this.sources = withVolumes(found);
      if (this.sources.length > 0 && !this.streams(tiles, limits)) {
        await this.loader.load(this.sources, tiles, limits, abort.signal, onTexels);
      }
    } catch (error) {
      if (!abort.signal.aborted) onError(error);
    } finally {
      if (this.loading === abort) this.loading = null;
      onChange();
    }
  }

  /** Requests bricks for the current view if there is a single tile. Returns whether the host sends bricks. */
  private streams(tiles: readonly string[], limits: VolumeLimits): boolean {
    const [tile] = tiles;
    const [first] = this.sources;
    const volume = first.tiles.get(tile)?.volume;
    if (tiles.length !== 1 || volume === undefined || this.bricks === null) return false;
    const made = this.bricks.tile(
      tile,
      limits,
      () => this.takeBricks(),
      () => this.refuseBricks(),
    );
    if (made === null) return false;
    const sources = this.sources.flatMap(({ id, tiles: of }) => {
      const source = of.get(tile);
      return source === undefined ? [] : [[id, source] as const];
    });
    this.brickTile = made;
    made.want(new Map(sources));
    return true;
  }

  /** Passes the bricks on that have loaded since the last call. */
  private takeBricks(): void {
    const { brickTile } = this;
    if (brickTile?.shown != null && brickTile.shown !== this.packed) {
      const { shown } = brickTile;
      this.packed = shown;
      const [source] = brickTile.kept.values();
      const frame = frameOf([volumeOfBricks(source.volume)]);
      const { channels, level, texture, index, bricks } = shown;
      const release = () => undefined; // the streamed tile owns the texture
      const { size } = frame;
      this.handlers.onTexels({ channels, frame, level, size, texture, index, bricks, release });
    }
    this.handlers.onChange();
  }

  /** Returns whether the transfer functions show intensities that the streamed bricks leave out. */
  lacks(appearances: readonly Appearance[]): boolean {
    return this.brickTile !== null && showsBelow(this.brickTile, appearances);
  }

  /** Stops using bricks for this tile; files are loaded from now on. */
  refuseBricks(): void {
    if (this.brickTile === null) return;
    const [{ tile }] = [...this.brickTile.kept.values()].map(({ volume }) => volume);
    this.bricks?.refuse(tile);
    this.handlers.onRefused();
  }

  /** Shows more of the loaded bricks. Returns whether some are still hidden. */
  advance(dt_s: number): boolean {
    return this.brickTile?.advance(dt_s) ?? false;
  }

  /** Cancels all loading, and releases the streamed tile. */
  drop(): void {
    this.loading?.abort();
    this.loading = null;
    this.brickTile?.dispose();
    this.brickTile = null;
    this.packed = null;
  }

  dispose(): void {
    this.drop();
    this.loader.dispose();
  }
}
