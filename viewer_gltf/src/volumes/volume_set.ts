/** All volumes on screen: shows and hides them, loads missing ones and removes unused ones. */
import { BundleError } from "../bundle/errors";
import type { Bounds } from "../bundle/generated/bundle";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Bundle } from "../bundle/load";
import type { Volumes } from "../host/services";
import type { Vec3 } from "../math/vec3";
import type { MarchedVolumes, MarchView, VolumeStatus } from "../render/drawn_forms";
import type { ShownVolume } from "../state/on_screen";
import { isTraced } from "../state/parameters/volumes";
import type { WantedTile } from "../state/representation";
import type { ViewerState } from "../state/viewer_state";
import type { BrickService } from "../voxels/bricks/brick_service";
import { tilesToSharpen } from "../voxels/bricks/looked_at";
import type { BrickView } from "../voxels/bricks/protocol";
import { SharpenedTile } from "../voxels/bricks/sharpened_tile";
import { LoadQueue } from "../voxels/load_queue";
import type { MarchFrame } from "../voxels/march_frame";
import { levelsToFetch, type VolumeLimits } from "../voxels/mip_levels";
import { TileTexture } from "../voxels/tile_texture";
import type { VolumeSource } from "../voxels/volume_source";
import { stride } from "../voxels/volume_texture";
import { ChannelAppearances } from "./channel_appearances";
import { ChannelLists } from "./channel_volumes";
import { Marches } from "./marches";
import { Residency, type Resident } from "./residency";

const PARALLEL_LOADS = 4;
/**
 * Largest size, in bytes, of the mip level of a channel in a tile while the march only stands in
 * for path tracing.
 */
const STAND_IN_BYTES = 2 ** 21;

export class VolumeSet implements MarchedVolumes, Volumes {
  private readonly queue = new LoadQueue(PARALLEL_LOADS);
  private readonly channels: ChannelLists;
  private readonly residents: Residency;
  readonly marches: Marches;
  readonly appearances: ChannelAppearances;
  private state: ViewerState | null = null;
  private wanted: readonly WantedTile[] = [];
  private mayRefine = true;
  private hasReportedLimit = false;
  /** Box of each tile, um, world. */
  private readonly bounds: ReadonlyMap<string, Bounds>;

  constructor(
    bundle: Bundle,
    frame: MarchFrame,
    private limits: VolumeLimits,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
    /** Streams bricks from a host; null if volumes are files. */
    private readonly bricks: BrickService | null = null,
  ) {
    this.residents = new Residency(limits.bytes);
    this.bounds = new Map(bundle.manifest.tiles.map(({ id, bounds_um }) => [id, bounds_um]));
    const onList = () => {
      if (this.state !== null) this.sync(this.state, this.wanted, this.mayRefine);
      this.onChange();
    };
    this.channels = new ChannelLists(bundle, onList, onError);
    this.appearances = new ChannelAppearances(this.channels);
    this.marches = new Marches(this.residents, this.appearances, frame, onChange, onError);
  }

  get isLoading(): boolean {
    return (
      this.marches.isLoading ||
      this.channels.isLoading ||
      this.residents.all.some(({ texture }) => texture.isLoading)
    );
  }

  /** Whether a wanted volume is not shown at any mip level. */
  get isIncomplete(): boolean {
    return this.wanted.some(({ tile, channels }) => {
      const shown = this.residents.get(tile)?.texture.shown?.channels ?? [];
      const isThere = (id: string) => this.channels.get(id)?.sources.has(tile) ?? true;
      return channels.some((id) => !shown.includes(id) && isThere(id));
    });
  }

  get isInDisc(): boolean {
    return this.marches.isInDisc;
  }

  /** Sets the view. Call it before every frame; see `Marches`. */
  aim(view: MarchView): void {
    this.marches.aim(this.state, view);
  }

  /** Bytes on the GPU. */
  get bytes(): number {
    return this.residents.bytes;
  }

  status(): readonly VolumeStatus[] {
    return this.residents.byTile.flatMap(([tile, { texture, wanted }]) =>
      (wanted?.channels ?? []).map((id) => ({
        tile,
        channel: id,
        level: texture.shown?.channels.includes(id) ? texture.shown.level : null,
      })),
    );
  }

  /**
   * A text that changes when a march would look different: with each loaded mip level, and
   * during a fade with each step.
   */
  get marchKey(): string {
    return JSON.stringify([this.status(), this.marches.key]);
  }

  /** How far the volume of a channel in a tile has faded in, 0 to 1. */
  presence(tile: string, channel: string): number {
    return this.residents.presence(tile, channel);
  }

  /** The source of a channel's volume in a tile; null if it is not known yet or there is none. */
  source(tile: string, channel: string): VolumeSource | null {
    return this.channels.get(channel)?.sources.get(tile) ?? null;
  }

  /** All volumes of a channel, by tile; null if the list failed to load, which is reported. */
  async sourcesOf(channel: string): Promise<ReadonlyMap<string, VolumeSource> | null> {
    await this.channels.load(channel);
    return this.channels.get(channel)?.sources ?? null;
  }

  /**
   * The source of a channel's volume in a tile, when it is known; null if there is none or the list
   * failed to load.
   */
  async sourceOf(tile: string, channel: string): Promise<VolumeSource | null> {
    await this.channels.load(channel);
    return this.source(tile, channel);
  }

  shown(): readonly ShownVolume[] {
    return this.state === null ? [] : this.marches.shown(this.state);
  }

  /**
   * Outermost points, um, world, of the visible part of a channel's volumes; null if they are not
   * all loaded.
   */
  outline(channel: string): readonly Vec3[] | null {
    const tiles = this.wanted.filter(({ channels }) => channels.includes(channel));
    const points: Vec3[] = [];
    for (const { tile } of tiles) {
      const { march, packed } = this.residents.get(tile) ?? {};
      const at = packed?.channels.indexOf(channel) ?? -1;
      if (march == null || packed == null || at < 0) return null;
      points.push(...march.outline(packed.bricks[at], at));
    }
    return points.length === 0 ? null : points;
  }

  /** Whether all wanted volumes of a tile are loaded, at any mip level. */
  isReady(tile: string): boolean {
    const resident = this.residents.get(tile);
    const shown = resident?.texture.shown;
    if (resident?.wanted == null || shown == null) return false;
    return resident.wanted.channels.every(
      (id) => shown.channels.includes(id) || !this.canCome(id, tile),
    );
  }

  /** Advances all fades. Returns whether any is still going on. */
  advance(dt_s: number): boolean {
    const isFading = this.residents.advance(dt_s);
    this.marches.show();
    return isFading;
  }

  /**
   * Takes over the state and the wanted volumes.
   *
   * @param mayRefine false while the gaze wanders, so that no finer mip levels are loaded
   */
  sync(state: ViewerState, wanted: readonly WantedTile[], mayRefine: boolean): void {
    // A host that streams bricks sends a tile's bricks to one receiver only: to path tracing while
    // the march stands in.
    if (this.bricks !== null && this.state !== null && isTraced(this.state) !== isTraced(state)) {
      this.residents.dropAll();
    }
    this.state = state;
    this.wanted = wanted;
    this.mayRefine = mayRefine;
    this.residents.clearWanted();
    for (const each of wanted) this.want(each);
    this.channels.forgetFailed(wanted.flatMap(({ channels }) => channels));
    this.residents.evict();
    for (const [tile] of this.residents.byTile) this.march(tile);
  }

  /**
   * Requests finer volumes of the tile that is looked at, one tile at a time. Call it in every
   * frame.
   */
  sharpen(view: BrickView): void {
    const { all } = this.residents;
    if (!this.mayRefine || all.some(({ texture }) => isSharpening(texture))) return;
    const coarse = this.wanted.flatMap(({ tile: id }) => {
      const texture = this.residents.get(id)?.texture;
      if (!(texture instanceof SharpenedTile && texture.canSharpen)) return [];
      const [{ volume }] = texture.kept.values();
      return [
        { id, bounds_um: this.bounds.get(id) ?? volume.bounds_um, texel_um: texelOf(volume) },
      ];
    });
    const [next] = tilesToSharpen(coarse, view);
    const texture = next === undefined ? null : this.residents.get(next)?.texture;
    if (texture instanceof SharpenedTile) texture.sharpen();
  }

  /** Limits the number of voxels along an edge of a tile's volume, from the next `sync` on. */
  limitEdge(edge: number): void {
    this.limits = { ...this.limits, edge };
  }

  /** Lets failed volumes be loaded again by the next `sync`. */
  retryFailed(): void {
    this.channels.forgetFailed();
    for (const { texture } of this.residents.all) texture.retryFailed();
  }

  private want(wanted: WantedTile): void {
    const sources = new Map<string, VolumeSource>();
    for (const id of wanted.channels) {
      void this.channels.load(id);
      const source = this.source(wanted.tile, id);
      if (source !== null) sources.set(id, source);
    }
    let resident = this.residents.get(wanted.tile);
    if (resident === undefined) {
      if (sources.size === 0) return;
      resident = this.addTile(wanted.tile, this.isOfSource(wanted.channels));
    }
    this.residents.want(resident, wanted);
    const [first] = sources.values();
    if (first === undefined) return;
    this.reportLimit(first);
    const isStandIn = this.state !== null && isTraced(this.state);
    const bytes = this.residents.share(this.wanted.length) / stride(sources.size);
    const levels = levelsToFetch(
      first.volume.levels,
      isStandIn ? Math.min(bytes, STAND_IN_BYTES) : bytes,
      Math.min(this.limits.side, this.limits.edge),
    );
    const finest = levels[levels.length - 1];
    resident.texture.want(sources, this.mayRefine ? levels : levels.slice(0, 1), finest);
  }

  /**
   * Reports once that a volume can be drawn only at a mip level that is coarser than the finest one
   * in the volume's file.
   */
  private reportLimit({ volume }: VolumeSource): void {
    const { side } = this.limits;
    const longest = Math.max(...volume.size);
    if (longest <= side || this.hasReportedLimit) return;
    this.hasReportedLimit = true;
    this.onError(tooLong(longest, side));
  }

  private isOfSource(channels: readonly string[]): boolean {
    const sources = channels.flatMap((id) => [...(this.channels.get(id)?.sources.values() ?? [])]);
    return sources.some(({ volume }) => volume.finer_size !== undefined);
  }

  /**
   * @param isOfSource whether the host has finer volumes than files, as for a source that is not
   *   built
   */
  private addTile(tile: string, isOfSource: boolean): Resident {
    const onChange = () => {
      this.march(tile);
      this.onChange();
    };
    const limits = { ...this.limits, bytes: this.residents.share(this.wanted.length) };
    const bricks = this.state !== null && isTraced(this.state) ? null : this.bricks;
    const files = new TileTexture(this.queue, onChange, this.onError);
    if (bricks === null) return this.residents.add(tile, files);
    if (isOfSource) {
      const make = (refuse: () => void) => bricks.tile(tile, limits, onChange, refuse);
      return this.residents.add(tile, new SharpenedTile(files, make, onChange));
    }
    const made = bricks.tile(tile, limits, onChange, () => this.replace(tile));
    return this.residents.add(tile, made ?? files);
  }

  /** Loads a tile as files if its bricks are refused. */
  private replace(tile: string): void {
    const resident = this.residents.get(tile);
    if (resident === undefined) return;
    if (resident.texture instanceof SharpenedTile) {
      resident.texture.showCoarse();
      return;
    }
    this.bricks?.refuse(tile);
    this.residents.drop(tile);
    if (this.state !== null) this.sync(this.state, this.wanted, this.mayRefine);
  }

  private canCome(channel: string, tile: string): boolean {
    const volumes = this.channels.get(channel);
    if (volumes === undefined) return !this.channels.hasFailed(channel);
    return volumes.sources.has(tile) && !this.residents.get(tile)?.texture.hasFailed(channel);
  }

  private march(tile: string): void {
    const { state } = this;
    const resident = this.residents.get(tile);
    if (state === null || resident === undefined) return;
    if (!this.marches.sync(resident, state)) this.replace(tile);
  }

  /** Releases all GPU resources; wanted volumes are loaded again. */
  forget(): void {
    this.residents.dropAll();
    this.marches.forget();
  }

  dispose(): void {
    this.forget();
    this.marches.dispose();
  }
}

function tooLong(longest: number, side: number): BundleError {
  return new BundleError(
    `This device draws volumes of at most ${side} voxels along an edge. ` +
      `Volumes of ${longest} voxels are shown at a coarser level.`,
  );
}

function isSharpening(texture: Resident["texture"]): boolean {
  return texture instanceof SharpenedTile && texture.isSharpening;
}

/** Longest edge of a texel, um. */
function texelOf({ bounds_um: { min, max }, size, apron }: TileVolume): number {
  return Math.max(...size.map((n, i) => (max[i] - min[i]) / Math.max(1, n - 2 * apron - 1)));
}
