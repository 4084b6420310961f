/** Loads the texels of the tiles that are wanted, from files or from a host that sends bricks by view. */
import { BundleError } from "../bundle/errors";
import { isTraced } from "../state/parameters/volumes";
import type { WantedTile } from "../state/representation";
import type { ViewerState } from "../state/viewer_state";
import type { BrickService } from "./bricks/brick_service";
import type { ChannelLists } from "./channel_volumes";
import { LoadQueue } from "./load_queue";
import { levelsToFetch, type VolumeLimits } from "./mip_levels";
import type { Residency, Resident } from "./residency";
import { TileTexture } from "./tile_texture";
import type { VolumeSource } from "./volume_source";
import { stride } from "./volume_texture";

const PARALLEL_LOADS = 4;
/** Most bytes of a channel in a tile, where the march only stands in for paths of light. */
const STAND_IN_BYTES = 2 ** 21;

export type TileLoadOptions = Readonly<{
  channels: ChannelLists;
  residents: Residency;
  /** null: volumes come as files. */
  bricks: BrickService | null;
  /** Texels of a tile have come, or are drawn otherwise. */
  onTexels: (tile: string) => void;
  /** A tile that can't be had as bricks is to come as files. */
  onReplace: (tile: string) => void;
  onError: (error: unknown) => void;
}>;

/** The request for all volumes: the state, the tiles, and whether finer levels may be begun. */
export type VolumeRequest = Readonly<{
  state: ViewerState;
  tiles: readonly WantedTile[];
  mayRefine: boolean;
}>;

export class TileLoads {
  private readonly queue = new LoadQueue(PARALLEL_LOADS);
  private hasReportedLimit = false;

  constructor(
    private limits: VolumeLimits,
    private readonly options: TileLoadOptions,
  ) {}

  /** Draws volumes of at most so many voxels along an edge, from the next request on. */
  limitEdge(edge: number): void {
    this.limits = { ...this.limits, edge };
  }

  want(wanted: WantedTile, request: VolumeRequest): void {
    const { channels, residents } = this.options;
    const sources = new Map<string, VolumeSource>();
    for (const id of wanted.channels) {
      void channels.load(id);
      const source = channels.get(id)?.sources.get(wanted.tile);
      if (source !== undefined) sources.set(id, source);
    }
    let resident = residents.get(wanted.tile);
    if (resident === undefined) {
      if (sources.size === 0) return;
      resident = this.addTile(wanted.tile, request);
    }
    residents.want(resident, wanted);
    const [first] = sources.values();
    if (first === undefined) return;
    this.reportLimit(first);
    const share = this.shareOf(request) / stride(sources.size);
    const levels = levelsToFetch(
      first.volume.levels,
      isTraced(request.state) ? Math.min(share, STAND_IN_BYTES) : share,
      Math.min(this.limits.side, this.limits.edge),
    );
    const finest = levels[levels.length - 1];
    resident.texture.want(sources, request.mayRefine ? levels : levels.slice(0, 1), finest);
  }

  /** Whether a channel of a tile can still come. */
  canCome(channel: string, tile: string): boolean {
    const { channels, residents } = this.options;
    const volumes = channels.get(channel);
    if (volumes === undefined) return !channels.hasFailed(channel);
    return volumes.sources.has(tile) && !residents.get(tile)?.texture.hasFailed(channel);
  }

  /** Bytes of the GPU's memory for each tile. */
  private shareOf({ tiles }: VolumeRequest): number {
    return this.options.residents.share(tiles.length);
  }

  /** Reports once that the drawn level is coarser than the finest one there is. */
  private reportLimit({ volume }: VolumeSource): void {
    const { side } = this.limits;
    const longest = Math.max(...volume.size);
    if (longest <= side || this.hasReportedLimit) return;
    this.hasReportedLimit = true;
    this.options.onError(
      new BundleError(
        `This device draws volumes of at most ${side} voxels along an edge: ` +
          `those of ${longest} are shown at a coarser level.`,
      ),
    );
  }

  private addTile(tile: string, request: VolumeRequest): Resident {
    const { residents, onTexels, onReplace, onError } = this.options;
    const onChange = () => onTexels(tile);
    const limits = { ...this.limits, bytes: this.shareOf(request) };
    const bricks = isTraced(request.state) ? null : this.options.bricks;
    const texture =
      bricks?.tile(tile, limits, onChange, () => onReplace(tile)) ??
      new TileTexture(this.queue, onChange, onError);
    return residents.add(tile, texture);
  }
}
