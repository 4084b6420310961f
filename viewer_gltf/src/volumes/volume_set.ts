/** All volumes on screen: shows and hides them, loads missing ones, drops unused ones. */
import { Group, type Matrix4, Scene, Vector3 } from "three";
import { BundleError } from "../bundle/errors";
import type { Bundle } from "../bundle/load";
import type { Shapes, Transfer2d } from "../bundle/transfer_2d";
import type { MarchClip } from "../gpu/clip_uniforms";
import type { Vec3 } from "../math/vec3";
import type { ShownVolume } from "../state/on_screen";
import { canBeShaded, isTraced } from "../state/parameters/volumes";
import { isInDisc, type WantedTile } from "../state/representation";
import { isTwoD, shapesOf } from "../state/transfer_functions_2d";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { BrickTile } from "./bricks/brick_atlas";
import type { BrickService } from "./bricks/brick_service";
import { ChannelLists } from "./channel_volumes";
import { OccupancyClient } from "./empty_space_client";
import { CoarseTexels } from "./light/coarse_texels";
import type { DepthShading, Marched } from "./light/depth_shading";
import { LoadQueue } from "./load_queue";
import { levelsToFetch, type VolumeLimits } from "./mip_levels";
import { Residency, type Resident } from "./residency";
import { brickCounts } from "./skip_bricks";
import { type Appearance, floorOf, type MarchFrame, TileMarch } from "./tile_raymarch";
import { type Packed, TileTexture } from "./tile_texture";
import { tracedTable, tracedTable2d } from "./traced_table";
import { lookUpTable, opacities } from "./transfer_luts";
import { NO_ENTRIES, type TransferTable2d, transferTable2d } from "./transfer_table_2d";
import type { VolumeSource } from "./volume_source";
import { stride } from "./volume_texture";

const PARALLEL_LOADS = 4;
/** Most bytes of a channel in a tile, where the march only stands in for paths of light. */
const STAND_IN_BYTES = 2 ** 21;
type MadeTable2d = Readonly<{
  shapes: Shapes;
  transfer2d: Transfer2d;
  window: readonly [number, number];
  opacity: number;
  table: TransferTable2d;
}>;

export type VolumeStatus = Readonly<{
  tile: string;
  channel: string;
  /** Mip level on screen, 0 is the finest; null: none yet. */
  level: number | null;
}>;

export class VolumeSet {
  readonly scene = new Scene();
  private readonly group = new Group();
  private readonly queue = new LoadQueue(PARALLEL_LOADS);
  private readonly occupancy = new OccupancyClient();
  private readonly channels: ChannelLists;
  private readonly residents: Residency;
  /** What shades; its code comes with the first volumes that are shaded. */
  private shading: DepthShading | null = null;
  private shadingIs: "none" | "coming" | "there" | "failed" = "none";
  /** The last table of each channel: all tiles ask for the same. */
  private readonly tables2d = new Map<string, MadeTable2d>();
  private state: ViewerState | null = null;
  private wanted: readonly WantedTile[] = [];
  private mayRefine = true;
  /** Tables of skips that are being made. */
  private skipsUnderWay = 0;
  private hasReportedLimit = false;

  constructor(
    bundle: Bundle,
    private readonly frame: MarchFrame,
    private limits: VolumeLimits,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
    /** From a host that sends bricks by view; null: volumes come as files. */
    private readonly bricks: BrickService | null = null,
  ) {
    this.residents = new Residency(limits.bytes);
    const onList = () => {
      if (this.state !== null) this.follow(this.state, this.wanted, this.mayRefine);
      this.onChange();
    };
    this.channels = new ChannelLists(bundle, onList, onError);
    this.group.matrixAutoUpdate = false;
    this.scene.add(this.group);
  }

  get isLoading(): boolean {
    return (
      this.skipsUnderWay > 0 ||
      this.shadingIs === "coming" ||
      this.shading?.isLoading === true ||
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

  /** Whether anything is to be marched. */
  get isEmpty(): boolean {
    return !this.group.children.some(({ visible }) => visible);
  }

  /** Whether all that is marched shows in the disc alone. */
  get isInDisc(): boolean {
    const drawn = this.drawn();
    return drawn.length > 0 && drawn.every(({ march }) => march.isInDisc);
  }

  /** Whether of what is marched some shows in the disc alone, and some beyond it too. */
  get isPartlyInDisc(): boolean {
    return !this.isInDisc && this.drawn().some(({ march }) => march.isPartlyInDisc);
  }

  /** March what lies in the disc's cone alone, whatever the channels; false: as each shows. */
  endAtDisc(ends: boolean): void {
    for (const { march } of this.drawn()) march.endAtDisc(ends);
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
    const drawn = this.drawn().map(({ march, packed, resident: { texture, presence } }) => [
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
        const { table, isInDisc } = this.appearance(state, channel);
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
      (id) => shown.channels.includes(id) || !this.canCome(id, tile),
    );
  }

  /** Places the volumes: they lie in the specimen's world. `specimen` is its pose in the room. */
  placeAs(specimen: Matrix4): void {
    this.group.matrix.copy(specimen);
    this.group.matrixWorldNeedsUpdate = true;
  }

  /** Before every frame. `eye` and the disc's cone in um, world; `lamp`: the direction towards it. */
  aim(eye: Vector3, apex: Vector3, axis: Vector3, clip: MarchClip, lamp: Vector3): void {
    const boxes = new Bounds();
    const drawn = this.drawn();
    for (const { march } of drawn) boxes.add(march);
    this.shade(drawn, clip, lamp);
    const { state } = this;
    this.frame.uDensity.value = state !== null && isTraced(state) ? state.trace.density : 1;
    for (const { march } of drawn) {
      this.shading?.place(march);
      march.sortBy(eye);
      march.aim(apex, axis);
      march.clip(clip);
      march.shareWith(boxes.min, boxes.max, boxes.count);
    }
  }

  private shade(drawn: readonly Marched[], clip: MarchClip, lamp: Vector3): void {
    const { state, frame, onChange, onError } = this;
    const strength = state !== null && canBeShaded(state) ? state.depthShading : 0;
    if (strength > 0 && drawn.length > 0 && this.shadingIs === "none") {
      this.shadingIs = "coming";
      import("./light/depth_shading")
        .then(({ DepthShading }) => {
          this.shading = new DepthShading(
            frame,
            new CoarseTexels(onChange, onError),
            onChange,
            onError,
          );
          this.shadingIs = "there";
        })
        .catch((error: unknown) => {
          this.shadingIs = "failed"; // volumes are drawn without
          onError(error);
        })
        .finally(onChange);
    }
    this.shading?.set(strength);
    this.shading?.follow(drawn, clip, lamp);
  }

  /** Go on with all fades; whether any is still under way. */
  advance(dt_s: number): boolean {
    const isFading = this.residents.advance(dt_s);
    for (const resident of this.residents.all) this.show(resident);
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
    this.state = state;
    this.wanted = wanted;
    this.mayRefine = mayRefine;
    this.residents.unwantAll();
    for (const each of wanted) this.want(each);
    this.channels.forgetFailed(wanted.flatMap(({ channels }) => channels));
    this.residents.evict();
    for (const resident of this.residents.all) this.setAppearances(resident);
  }

  /** From the next `follow` on. */
  limitEdge(edge: number): void {
    this.limits = { ...this.limits, edge };
  }

  /** With the next `follow`, what has failed is loaded anew. */
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
      resident = this.addTile(wanted.tile);
    }
    this.residents.want(resident, wanted);
    const [first] = sources.values();
    if (first === undefined) return;
    this.reportLimit(first);
    const isStandIn = this.state !== null && isTraced(this.state);
    const share = this.share / stride(sources.size);
    const levels = levelsToFetch(
      first.volume.levels,
      isStandIn ? Math.min(share, STAND_IN_BYTES) : share,
      Math.min(this.limits.side, this.limits.edge),
    );
    const finest = levels[levels.length - 1];
    resident.texture.want(sources, this.mayRefine ? levels : levels.slice(0, 1), finest);
  }

  /** Announced once: the drawn level is coarser than the finest one there is. */
  private reportLimit({ volume }: VolumeSource): void {
    const { side } = this.limits;
    const longest = Math.max(...volume.size);
    if (longest <= side || this.hasReportedLimit) return;
    this.hasReportedLimit = true;
    this.onError(
      new BundleError(
        `This device draws volumes of at most ${side} voxels along an edge: ` +
          `those of ${longest} are shown at a coarser level.`,
      ),
    );
  }

  private addTile(tile: string): Resident {
    const onChange = () => {
      const resident = this.residents.get(tile);
      if (resident !== undefined) this.setAppearances(resident);
      this.onChange();
    };
    const limits = { ...this.limits, bytes: this.share };
    const bricks = this.state !== null && isTraced(this.state) ? null : this.bricks;
    const texture =
      bricks?.tile(tile, limits, onChange, () => this.replace(tile)) ??
      new TileTexture(this.queue, onChange, this.onError);
    return this.residents.add(tile, texture);
  }

  /** A tile that can't be had as bricks comes as files. */
  private replace(tile: string): void {
    if (this.residents.get(tile) === undefined) return;
    this.bricks?.refuse(tile);
    this.residents.drop(tile);
    if (this.state !== null) this.follow(this.state, this.wanted, this.mayRefine);
  }

  /** Bytes of the GPU's memory for each tile. */
  private get share(): number {
    return this.residents.share(this.wanted.length);
  }

  private canCome(channel: string, tile: string): boolean {
    const volumes = this.channels.get(channel);
    if (volumes === undefined) return !this.channels.hasFailed(channel);
    return volumes.sources.has(tile) && !this.residents.get(tile)?.texture.hasFailed(channel);
  }

  /** A march for what has come, in the colours of the state. */
  private setAppearances(resident: Resident): void {
    const { state } = this;
    const { shown } = resident.texture;
    if (state === null) return;
    if (shown === null) {
      resident.march?.dispose();
      resident.march = null;
      resident.packed = null;
      return;
    }
    const appearances = shown.channels.map((id) => this.appearance(state, id));
    if (showsBelow(resident.texture, appearances)) {
      const [{ tile }] = [...resident.texture.kept.values()].map(({ volume }) => volume);
      this.replace(tile);
      return;
    }
    const isNewSet = resident.packed?.channels.join() !== shown.channels.join();
    const { march: before } = resident;
    let march = before;
    if (march === null || march.channelCount !== shown.channels.length) {
      before?.dispose();
      const volume = this.volumeOf(shown.channels[0], resident);
      march = new TileMarch(volume, shown.channels.length, this.frame);
      resident.march = march;
      this.group.add(march.mesh);
    }
    resident.packed = shown;
    march.composite(isTraced(state) ? "over" : state.compositing);
    const differs = march.setAppearances(appearances);
    if (differs || isNewSet || march !== before) void this.findSkips(march, shown, appearances);
  }

  private volumeOf(channel: string, { texture }: Resident) {
    const source = texture.kept.get(channel);
    if (source === undefined) throw new Error(`channel ${channel} has come without a source`);
    return source.volume;
  }

  /** The appearance of a channel. The channel's list must have come. */
  appearance(state: ViewerState, id: string): Appearance {
    const appearance = this.ownAppearance(state, id);
    if (!isTraced(state)) return appearance;
    const { trace } = state;
    const { table2d } = appearance;
    if (table2d == null) return { ...appearance, table: tracedTable(appearance.table, trace) };
    const shifted = tracedTable2d(table2d, trace);
    return { ...appearance, table2d: shifted, table: shifted.envelope };
  }

  /** Its appearance by its transfer function alone. */
  private ownAppearance(state: ViewerState, id: string): Appearance {
    const channel = state.channels.find((c) => c.id === id);
    const volumes = this.channels.get(id);
    if (channel === undefined || volumes === undefined) {
      throw new Error(`channel ${id} has come without a look`);
    }
    const table2d = this.table2dOf(channel);
    if (table2d !== null) {
      const { color } = channel;
      const { window } = channel;
      const table = table2d.envelope;
      return { color, table, table2d, window, isInDisc: isInDisc(state, channel) };
    }
    const { transferFunction: name } = channel;
    // one's own function has no one-dimensional one that stands for it
    const entries =
      volumes.transferFunctions.get(name) ?? (isTwoD(channel) ? NO_ENTRIES : undefined);
    if (entries === undefined) throw new Error(`no transfer function ${name}`);
    return {
      color: channel.color,
      table: lookUpTable(entries, channel.window, channel.opacity),
      window: channel.window,
      isInDisc: isInDisc(state, channel),
    };
  }

  /** The table of a two-dimensional function, as soon as its shapes have come. */
  private table2dOf(channel: ChannelState): TransferTable2d | null {
    const { id, transfer2d, window, opacity } = channel;
    const shapes = shapesOf(channel);
    if (transfer2d === null || shapes.length === 0) return null;
    const made = this.tables2d.get(id);
    const isSame =
      made?.shapes === shapes &&
      made.transfer2d === transfer2d &&
      made.window === window &&
      made.opacity === opacity;
    if (isSame) return made.table;
    const table = transferTable2d(shapes, transfer2d, window, opacity);
    this.tables2d.set(id, { shapes, transfer2d, window, opacity, table });
    return table;
  }

  private async findSkips(
    march: TileMarch,
    shown: Packed,
    appearances: readonly Appearance[],
  ): Promise<void> {
    march.skipBy(null); // what the old table skips over may show now
    this.skipsUnderWay++;
    const distances = await this.occupancy
      .computeDistances(march.volume.tile, {
        bricks: shown.bricks,
        alphas: appearances.map(({ table }) => opacities(table)),
        count: brickCounts(march.volume.size),
      })
      .finally(() => {
        this.skipsUnderWay--;
        this.onChange();
      });
    if (distances === null || this.residents.get(march.volume.tile)?.march !== march) return;
    march.skipBy(distances);
  }

  private show({ march, texture, packed, presence }: Resident): void {
    if (march === null || packed === null) return;
    march.mesh.visible = presence > 0;
    march.show(packed, texture.old, texture.fresh, presence);
  }

  private drawn(): Marched[] {
    return this.residents.all.flatMap((resident) => {
      const { march, packed } = resident;
      return march?.mesh.visible && packed !== null ? [{ march, packed, resident }] : [];
    });
  }

  /** Drop all that is on the GPU; what is wanted comes anew. */
  forget(): void {
    this.residents.dropAll();
    this.shading?.forget();
  }

  dispose(): void {
    this.forget();
    this.occupancy.dispose();
    this.shading?.dispose();
  }
}

/** Whether functions show what bricks leave out. */
export function showsBelow(
  texture: TileTexture | BrickTile,
  appearances: readonly Appearance[],
): boolean {
  if (!(texture instanceof BrickTile)) return false;
  const { thresholds } = texture;
  return appearances.some(({ table }, c) => Math.round(255 * floorOf(table)) < thresholds[c]);
}

/** The box round several marched tiles, um, world. */
class Bounds {
  readonly min = new Vector3().setScalar(Number.POSITIVE_INFINITY);
  readonly max = new Vector3().setScalar(Number.NEGATIVE_INFINITY);
  count = 0;

  add(march: TileMarch): void {
    march.growBox(this.min, this.max);
    this.count++;
  }
}
