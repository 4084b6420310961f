/** All volumes on screen: follows the state, loads what is missing, drops what is gone. */
import { type DepthTexture, Group, type Vector3 } from "three";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Bundle } from "../bundle/load";
import { loadVolumes } from "../bundle/load";
import { type ViewerState, volumeChannels, volumeTiles } from "../state";
import { levelsToFetch, VOLUME_BUDGET_BYTES } from "./levels";
import { loadTransferFunctions, type TransferFunction } from "./luts";
import { LoadQueue } from "./queue";
import { VolumeSource } from "./source";
import { type Part, TileMarch } from "./tile_march";
import { VolumeTexture } from "./volume_texture";

const PARALLEL_LOADS = 4;

type ChannelVolumes = Readonly<{
  sources: ReadonlyMap<string, VolumeSource>;
  transferFunctions: ReadonlyMap<string, TransferFunction>;
}>;

export type VolumeStatus = Readonly<{
  tile: string;
  channel: string;
  /** Mip level on screen, 0 is the finest; null: none yet. */
  level: number | null;
}>;

export class VolumeSet {
  /** In um, world. */
  readonly group = new Group();
  private readonly queue = new LoadQueue(PARALLEL_LOADS);
  private readonly channels = new Map<string, ChannelVolumes | "loading" | "failed">();
  private readonly textures = new Map<string, VolumeTexture>();
  private readonly marches = new Map<string, { looks: string; march: TileMarch }>();
  private state: ViewerState | null = null;

  constructor(
    private readonly bundle: Bundle,
    private readonly depth: DepthTexture,
    private readonly maxSide: number,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  get isLoading(): boolean {
    return (
      [...this.channels.values()].includes("loading") ||
      [...this.textures.values()].some((texture) => texture.isLoading)
    );
  }

  get isEmpty(): boolean {
    return this.marches.size === 0;
  }

  status(): readonly VolumeStatus[] {
    return [...this.textures].map(([key, { level }]) => {
      const [tile, channel] = key.split("/");
      return { tile, channel, level: Number.isFinite(level) ? level : null };
    });
  }

  /** Whether the volume is on screen, so that the surface can go. */
  has(tile: string, channel: string): boolean {
    return this.marches.has(tile) && this.textures.get(`${tile}/${channel}`)?.texture != null;
  }

  /** Far tiles first, before every frame. `eye` in um, world. */
  sortBy(eye: Vector3): void {
    for (const { march } of this.marches.values()) march.sortBy(eye);
  }

  follow(state: ViewerState): void {
    this.state = state;
    const channels = volumeChannels(state).map((channel) => ({
      id: channel.id,
      tiles: volumeTiles(state, channel),
    }));
    const count = channels.reduce((sum, { tiles }) => sum + tiles.length, 0);
    const budget = VOLUME_BUDGET_BYTES / Math.max(1, count);
    const wanted = new Set<string>();
    for (const { id, tiles } of channels) {
      const volumes = this.channels.get(id);
      if (volumes === undefined) void this.loadChannel(id);
      if (volumes === undefined || typeof volumes === "string") continue;
      for (const tile of tiles) {
        const source = volumes.sources.get(tile);
        if (source === undefined) continue;
        const key = `${tile}/${id}`;
        wanted.add(key);
        let texture = this.textures.get(key);
        if (texture === undefined) {
          texture = new VolumeTexture(
            source,
            this.bundle.base,
            this.queue,
            () => this.refresh(),
            this.onError,
          );
          this.textures.set(key, texture);
        }
        texture.want(levelsToFetch(source.volume.levels, budget, this.maxSide));
      }
    }
    for (const [key, texture] of this.textures) {
      if (wanted.has(key)) continue;
      texture.dispose();
      this.textures.delete(key);
    }
    for (const [id, volumes] of this.channels) {
      if (volumes === "failed" && !channels.some((c) => c.id === id)) this.channels.delete(id);
    }
    this.updateMarches(state);
  }

  private refresh(): void {
    if (this.state !== null) this.updateMarches(this.state);
    this.onChange();
  }

  private async loadChannel(id: string): Promise<void> {
    const channel = this.bundle.manifest.channels.find((c) => c.id === id);
    if (channel === undefined) throw new Error(`the bundle has no channel ${id}`);
    this.channels.set(id, "loading");
    try {
      const { base } = this.bundle;
      const [volumes, transferFunctions] = await Promise.all([
        loadVolumes(base, channel.volumes),
        loadTransferFunctions(base, channel),
      ]);
      const sources = new Map(
        [...volumes].map(([tile, volume]) => [tile, new VolumeSource(base, volume)]),
      );
      this.channels.set(id, { sources, transferFunctions });
    } catch (error) {
      this.channels.set(id, "failed");
      this.onError(error);
    }
    if (this.state !== null) this.follow(this.state);
    this.onChange();
  }

  private updateMarches(state: ViewerState): void {
    const tiles = new Set(volumeChannels(state).flatMap((c) => volumeTiles(state, c)));
    for (const [tile, { march }] of this.marches) {
      if (tiles.has(tile)) continue;
      march.dispose();
      this.marches.delete(tile);
    }
    for (const tile of tiles) this.updateMarch(state, tile);
  }

  private updateMarch(state: ViewerState, tile: string): void {
    const parts: Part[] = [];
    let box: TileVolume | null = null; // the same for all channels of a tile
    for (const channel of volumeChannels(state)) {
      const volumes = this.channels.get(channel.id);
      const volume = this.textures.get(`${tile}/${channel.id}`);
      if (volumes === undefined || typeof volumes === "string") continue;
      const transferFunction = volumes.transferFunctions.get(channel.transferFunction);
      if (volume?.texture == null || transferFunction === undefined) continue;
      box ??= volume.source.volume;
      parts.push({ channel: channel.id, volume, transferFunction, color: channel.color });
    }
    const looks = parts.map((part) => part.channel).join(" ");
    let found = this.marches.get(tile);
    if (found !== undefined && found.looks !== looks) {
      found.march.dispose();
      this.marches.delete(tile);
      found = undefined;
    }
    if (box === null) return;
    if (found === undefined) {
      const march = new TileMarch(box, parts.length, this.depth);
      found = { looks, march };
      this.marches.set(tile, found);
      this.group.add(march.mesh);
    }
    found.march.update(parts);
  }

  dispose(): void {
    for (const texture of this.textures.values()) texture.dispose();
    for (const { march } of this.marches.values()) march.dispose();
    this.textures.clear();
    this.marches.clear();
  }
}
