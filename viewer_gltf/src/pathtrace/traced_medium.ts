/** The texels that paths go through: from a host that sends bricks by view, or from files. */
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

/** The channels and tiles whose texels are wanted. */
export type MediumRequest = Readonly<{ channels: readonly string[]; tiles: readonly string[] }>;

export type MediumHandlers = Readonly<{
  /** Other texels have come. */
  onTexels: (texels: MediumTexels) => void;
  /** The bricks of the tile can't be had, or lack what is to show: all is to be asked for again. */
  onRefused: () => void;
  onChange: () => void;
  onError: (error: unknown) => void;
}>;

export class TracedMedium {
  private readonly loader = new MediumLoader();
  /** The volumes of each channel that was asked for last, once they are known. */
  sources: readonly ChannelSources[] = [];
  private loading: AbortController | null = null;
  /** Where texels come from as bricks; null: as files. */
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
   * The volumes that paths go through, for a caller that reads values at a point.
   *
   * @param isolated the one tile that is shown; null: all are
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

  /** Ask for bricks by view of a single tile. Returns whether the host sends them. */
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

  /** Hand on the bricks that have come, from time to time. */
  private takeBricks(): void {
    const { brickTile } = this;
    if (brickTile?.shown != null && brickTile.shown !== this.packed) {
      const { shown } = brickTile;
      this.packed = shown;
      const [source] = brickTile.kept.values();
      const frame = frameOf([volumeOfBricks(source.volume)]);
      const { channels, level, texture, index, bricks } = shown;
      const release = () => undefined; // the texture is the tile's own
      const { size } = frame;
      this.handlers.onTexels({ channels, frame, level, size, texture, index, bricks, release });
    }
    this.handlers.onChange();
  }

  /** Whether the bricks lack what functions show. */
  lacks(appearances: readonly Appearance[]): boolean {
    return this.brickTile !== null && showsBelow(this.brickTile, appearances);
  }

  /** Take files from now on. */
  refuseBricks(): void {
    if (this.brickTile === null) return;
    const [{ tile }] = [...this.brickTile.kept.values()].map(({ volume }) => volume);
    this.bricks?.refuse(tile);
    this.handlers.onRefused();
  }

  /** Show more of the bricks that have come. Returns whether there is more. */
  advance(dt_s: number): boolean {
    return this.brickTile?.advance(dt_s) ?? false;
  }

  /** Stop what is under way. */
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
