/** All volumes on screen: shows and hides them, loads missing ones, drops unused ones. */
import { type Matrix4, Scene, type Vector3 } from "three";
import type { Bundle } from "../bundle/load";
import type { MarchClip } from "../gpu/clip_uniforms";
import type { Vec3 } from "../math/vec3";
import type { ShownVolume } from "../state/on_screen";
import { isTraced } from "../state/parameters/volumes";
import type { WantedTile } from "../state/representation";
import type { ViewerState } from "../state/viewer_state";
import { Appearances } from "./appearances";
import type { BrickService } from "./bricks/brick_service";
import { ChannelLists } from "./channel_volumes";
import { LazyShading } from "./light/lazy_shading";
import { MarchSet } from "./march_set";
import { MarchedBox } from "./marched_box";
import type { VolumeLimits } from "./mip_levels";
import { Residency, type Resident } from "./residency";
import { TileLoads, type VolumeRequest } from "./tile_loads";
import type { MarchFrame } from "./tile_raymarch";
import type { VolumeSource } from "./volume_source";

export type VolumeStatus = Readonly<{
  tile: string;
  channel: string;
  /** Mip level on screen, 0 is the finest; null: none yet. */
  level: number | null;
}>;

export class VolumeSet {
  readonly scene = new Scene();
  /** How each channel looks. */
  readonly appearances: Appearances;
  private readonly channels: ChannelLists;
  private readonly residents: Residency;
  private readonly loads: TileLoads;
  private readonly shading: LazyShading;
  readonly marches: MarchSet;
  /** null until the first one. */
  private request: VolumeRequest | null = null;

  /** @param bricks a host that sends bricks by view; null: volumes come as files */
  constructor(
    bundle: Bundle,
    private readonly frame: MarchFrame,
    limits: VolumeLimits,
    private readonly onChange: () => void,
    onError: (error: unknown) => void,
    private readonly bricks: BrickService | null = null,
  ) {
    this.residents = new Residency(limits.bytes);
    const onList = () => {
      this.followAgain();
      this.onChange();
    };
    this.channels = new ChannelLists(bundle, onList, onError);
    this.appearances = new Appearances(this.channels);
    const { channels, residents } = this;
    this.loads = new TileLoads(limits, {
      ...{ channels, residents, bricks, onError },
      onTexels: (tile) => {
        const resident = this.residents.get(tile);
        if (resident !== undefined) this.dress(resident);
        this.onChange();
      },
      onReplace: (tile) => this.replace(tile),
    });
    this.shading = new LazyShading(frame, onChange, onError);
    this.marches = new MarchSet({
      ...{ frame, residents, appearances: this.appearances, onChange },
      onBelow: (tile) => this.replace(tile),
    });
    this.scene.add(this.marches.group);
  }

  get isLoading(): boolean {
    return (
      this.marches.isLoading ||
      this.shading.isLoading ||
      this.channels.isLoading ||
      this.residents.all.some(({ texture }) => texture.isLoading)
    );
  }

  /** Whether a volume that is wanted shows at no level. */
  get isIncomplete(): boolean {
    return this.wanted.some(({ tile, channels }) => {
      const shown = this.residents.get(tile)?.texture.shown?.channels ?? [];
      const isThere = (id: string) => this.channels.get(id)?.sources.has(tile) ?? true;
      return channels.some((id) => !shown.includes(id) && isThere(id));
    });
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

  /** A text that changes with what a march would draw: with the levels that have come, and in each step of a fade. */
  get marchKey(): string {
    const drawn = this.marches.drawn.map(({ march, packed, resident: { texture, presence } }) => [
      ...[march.volume.tile, packed.channels, packed.level, texture.fresh, presence],
    ]);
    return JSON.stringify([this.status(), drawn]);
  }

  /** How far the volume of a channel in a tile has faded in, 0..1. */
  presence(tile: string, channel: string): number {
    return this.residents.presence(tile, channel);
  }

  /** Where a channel's volume in a tile comes from; null: not known yet, or there is none. */
  source(tile: string, channel: string): VolumeSource | null {
    return this.channels.get(channel)?.sources.get(tile) ?? null;
  }

  /** All volumes of a channel, by tile; null: its list has not come, which was reported. */
  async sourcesOf(channel: string): Promise<ReadonlyMap<string, VolumeSource> | null> {
    await this.channels.load(channel);
    return this.channels.get(channel)?.sources ?? null;
  }

  /** The same, once it is known; null also after a fault, which was reported. */
  async sourceOf(tile: string, channel: string): Promise<VolumeSource | null> {
    await this.channels.load(channel);
    return this.source(tile, channel);
  }

  /** The channels of the tiles that are on screen. */
  shown(): readonly ShownVolume[] {
    const { state } = this;
    return this.residents.byTile.flatMap(([tile, { march, packed, texture }]) => {
      if (state === null || packed === null || !march?.mesh.visible) return [];
      return packed.channels.flatMap((channel) => {
        const source = texture.kept.get(channel);
        if (source === undefined) return [];
        const { table, isInDisc } = this.appearances.of(state, channel);
        return [{ tile, channel, source, table, isInDisc }];
      });
    });
  }

  /** Outermost points, um, world, of what a channel shows as volumes; null: not all has come. */
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

  /** Whether all that is wanted of a tile is there, at some level. */
  isReady(tile: string): boolean {
    const resident = this.residents.get(tile);
    const shown = resident?.texture.shown;
    if (resident?.wanted == null || shown == null) return false;
    return resident.wanted.channels.every(
      (id) => shown.channels.includes(id) || !this.loads.canCome(id, tile),
    );
  }

  /** Places the volumes: they lie in the specimen's world. `specimen` is its pose in the room. */
  placeAs(specimen: Matrix4): void {
    const { group } = this.marches;
    group.matrix.copy(specimen);
    group.matrixWorldNeedsUpdate = true;
  }

  /** Before every frame. `eye` and the disc's cone in um, world; `lamp`: the direction towards it. */
  aim(eye: Vector3, apex: Vector3, axis: Vector3, clip: MarchClip, lamp: Vector3): void {
    const boxes = new MarchedBox();
    const drawn = this.marches.drawn;
    for (const { march } of drawn) boxes.add(march);
    const { state } = this;
    this.shading.follow(state, drawn, clip, lamp);
    this.frame.uDensity.value = state !== null && isTraced(state) ? state.trace.density : 1;
    for (const { march } of drawn) {
      this.shading.place(march);
      march.sortBy(eye);
      march.aim(apex, axis);
      march.clip(clip);
      march.shareWith(boxes.min, boxes.max, boxes.count);
    }
  }

  /** Go on with all fades; whether any is still under way. */
  advance(dt_s: number): boolean {
    const isFading = this.residents.advance(dt_s);
    this.marches.showAll();
    return isFading;
  }

  /**
   * @param mayRefine false while the gaze wanders: then nothing finer is begun
   */
  follow(state: ViewerState, wanted: readonly WantedTile[], mayRefine: boolean): void {
    // a host that sends bricks sends those of a tile to one place: to what is traced, while the march
    // only stands in
    if (this.bricks !== null && this.state !== null && isTraced(this.state) !== isTraced(state)) {
      this.residents.dropAll();
    }
    const request = { state, tiles: wanted, mayRefine };
    this.request = request;
    this.residents.unwantAll();
    for (const each of wanted) this.loads.want(each, request);
    this.channels.forgetFailed(wanted.flatMap(({ channels }) => channels));
    this.residents.evict();
    for (const resident of this.residents.all) this.dress(resident);
  }

  /** From the next `follow` on. */
  limitEdge(edge: number): void {
    this.loads.limitEdge(edge);
  }

  /** With the next `follow`, what has failed is loaded anew. */
  retryFailed(): void {
    this.channels.forgetFailed();
    for (const { texture } of this.residents.all) texture.retryFailed();
  }

  /** A tile that can't be had as bricks comes as files. */
  private replace(tile: string): void {
    if (this.residents.get(tile) === undefined) return;
    this.bricks?.refuse(tile);
    this.residents.drop(tile);
    this.followAgain();
  }

  private dress(resident: Resident): void {
    if (this.state !== null) this.marches.dress(resident, this.state);
  }

  private followAgain(): void {
    if (this.request === null) return;
    const { state, tiles, mayRefine } = this.request;
    this.follow(state, tiles, mayRefine);
  }

  private get state(): ViewerState | null {
    return this.request?.state ?? null;
  }

  private get wanted(): readonly WantedTile[] {
    return this.request?.tiles ?? [];
  }

  /** Drop all that is on the GPU; what is wanted comes anew. */
  forget(): void {
    this.residents.dropAll();
    this.shading.forget();
  }

  dispose(): void {
    this.forget();
    this.marches.dispose();
    this.shading.dispose();
  }
}
