/**
 * The ray marches of all tiles with loaded volumes: one box each, with the textures and tables of
 * its channels.
 */
import { Group, type Matrix4, Scene, Vector3 } from "three";
import { cellCounts } from "../bundle/cell_ranges";
import type { TileVolume } from "../bundle/generated/volumes";
import type { DrawnMarches, MarchView } from "../render/drawn_forms";
import type { ShownVolume } from "../state/on_screen";
import { canBeShaded, isTraced } from "../state/parameters/volumes";
import type { ViewerState } from "../state/viewer_state";
import { showsBelow } from "../voxels/bricks/shows_below";
import type { OccupancyRequest } from "../voxels/empty_space";
import type { MarchFrame } from "../voxels/march_frame";
import type { Appearance } from "../voxels/march_tables";
import { brickCounts } from "../voxels/skip_bricks";
import type { Packed } from "../voxels/tile_texture";
import { opacities } from "../voxels/transfer_luts";
import { volumeOfBricks } from "../voxels/volume_source";
import type { ChannelAppearances } from "./channel_appearances";
import { OccupancyClient } from "./empty_space_client";
import type { Marched } from "./light/depth_shading";
import { LaterShading } from "./light/later_shading";
import type { Residency, Resident } from "./residency";
import { TileMarch } from "./tile_raymarch";

export class Marches implements DrawnMarches {
  readonly scene = new Scene();
  private readonly group = new Group();
  private readonly occupancy = new OccupancyClient();
  /** Has a worker of its own, since the many cells would delay the tables of bricks. */
  private readonly cells = new OccupancyClient();
  private readonly shading: LaterShading;
  private skipsUnderWay = 0;

  constructor(
    private readonly residents: Residency,
    private readonly appearances: ChannelAppearances,
    private readonly frame: MarchFrame,
    private readonly onChange: () => void,
    onError: (error: unknown) => void,
  ) {
    this.shading = new LaterShading(frame, onChange, onError);
    this.group.matrixAutoUpdate = false;
    this.scene.add(this.group);
  }

  get isLoading(): boolean {
    return this.skipsUnderWay > 0 || this.shading.isLoading;
  }

  get isEmpty(): boolean {
    return !this.group.children.some(({ visible }) => visible);
  }

  /** Whether all marched volumes show only inside the disc. */
  get isInDisc(): boolean {
    const { drawn } = this;
    return drawn.length > 0 && drawn.every(({ march }) => march.tables.isInDisc);
  }

  /** Whether some marched volumes show only inside the disc and others everywhere. */
  get isPartlyInDisc(): boolean {
    return !this.isInDisc && this.drawn.some(({ march }) => march.tables.isPartlyInDisc);
  }

  /** Restricts all marches to the disc's cone, or lets each channel show where it should. */
  endAtDisc(ends: boolean): void {
    for (const { march } of this.drawn) march.endAtDisc(ends);
  }

  get drawn(): readonly Marched[] {
    return this.residents.all.flatMap((resident) => {
      const { march, packed } = resident;
      return march?.mesh.visible && packed !== null ? [{ march, packed, resident }] : [];
    });
  }

  /**
   * Values that change when the marches look different, such as a new mip level or a step of a
   * fade.
   */
  get key(): readonly unknown[] {
    return this.drawn.map(({ march, packed, resident: { texture, presence } }) => [
      ...[march.volume.tile, packed.channels, packed.level, texture.fresh, presence],
    ]);
  }

  /** The channels of the tiles that are on screen. */
  shown(state: ViewerState): readonly ShownVolume[] {
    return this.drawn.flatMap(({ march, packed, resident: { texture } }) =>
      packed.channels.flatMap((channel) => {
        const source = texture.kept.get(channel);
        if (source === undefined) return [];
        const { table, isInDisc } = this.appearances.of(state, channel);
        return [{ tile: march.volume.tile, channel, source, table, isInDisc }];
      }),
    );
  }

  /**
   * Updates the march of a tile's loaded volumes to the state. Returns false if its bricks lack a
   * channel that is shown now.
   */
  sync(resident: Resident, state: ViewerState): boolean {
    const { shown } = resident.texture;
    if (shown === null) {
      resident.march?.dispose();
      resident.march = null;
      resident.packed = null;
      return true;
    }
    const appearances = shown.channels.map((id) => this.appearances.of(state, id));
    if (showsBelow(resident.texture, appearances)) return false;
    const isNewSet = resident.packed?.channels.join() !== shown.channels.join();
    const isNewLevel = resident.packed?.texture !== shown.texture;
    const { march: before } = resident;
    const march = this.marchOf(resident, shown);
    resident.packed = shown;
    march.composite(isTraced(state) ? "over" : state.compositing);
    const differs = march.setAppearances(appearances);
    const isNew = differs || isNewSet || march !== before;
    if (isNew) void this.findSkips(march, shown, appearances);
    if (isNew || isNewLevel) void this.findCells(march, shown, appearances);
    return true;
  }

  private marchOf(resident: Resident, packed: Packed): TileMarch {
    const { march: before } = resident;
    const { channels } = packed;
    const volume = volumeOf(packed, resident);
    // a channel that was just hidden is still packed, but its source is gone
    const isSameGrid = volume === null || before?.volume.size.join() === volume.size.join();
    if (before?.channelCount === channels.length && isSameGrid) return before;
    if (volume === null) throw new Error(`channel ${channels[0]} is loaded without a source`);
    before?.dispose();
    const march = new TileMarch(volume, channels.length, this.frame);
    resident.march = march;
    this.group.add(march.mesh);
    return march;
  }

  private async findSkips(
    march: TileMarch,
    shown: Packed,
    appearances: readonly Appearance[],
  ): Promise<void> {
    // nothing is skipped until the new table is computed: bricks that the old table skips may be
    // visible now
    march.skips.setBricks(null);
    const distances = await this.distancesFrom(this.occupancy, march, {
      bricks: shown.bricks,
      alphas: appearances.map(({ table }) => opacities(table)),
      count: brickCounts(march.volume.size),
    });
    if (distances !== null) march.skips.setBricks(distances);
  }

  /** Finds the smaller cells that a level leaves empty, if it is not a level of streamed bricks. */
  private async findCells(
    march: TileMarch,
    shown: Packed,
    appearances: readonly Appearance[],
  ): Promise<void> {
    if (shown.cells === null) return;
    const size = march.volume.levels[shown.level].size;
    const distances = await this.distancesFrom(this.cells, march, {
      bricks: shown.cells,
      alphas: appearances.map(({ table }) => opacities(table)),
      count: cellCounts(size),
    });
    if (distances !== null) march.skips.setCells(shown, distances, size);
  }

  /** Returns null if a newer request has replaced this one, or the march is gone. */
  private async distancesFrom(
    client: OccupancyClient,
    march: TileMarch,
    request: OccupancyRequest,
  ): Promise<Uint8Array<ArrayBuffer> | null> {
    const { tile } = march.volume;
    this.skipsUnderWay++;
    const distances = await client.computeDistances(tile, request).finally(() => {
      this.skipsUnderWay--;
      this.onChange();
    });
    return this.residents.get(tile)?.march === march ? distances : null;
  }

  /** Passes to each march how far its volume, and the newest mip level of it, have faded in. */
  show(): void {
    for (const { march, texture, packed, presence } of this.residents.all) {
      if (march === null || packed === null) continue;
      march.mesh.visible = presence > 0;
      march.show(packed, texture.old, texture.fresh, presence);
    }
  }

  /** Sets the pose of the specimen in the scene; the volumes lie in the specimen's world. */
  placeAs(specimen: Matrix4): void {
    this.group.matrix.copy(specimen);
    this.group.matrixWorldNeedsUpdate = true;
  }

  /** Updates the marches to the view. Call it before every frame. */
  aim(state: ViewerState | null, { eye, apex, axis, clip, lamp }: MarchView): void {
    const boxes = new Bounds();
    const { drawn } = this;
    for (const { march } of drawn) boxes.add(march);
    const strength = state !== null && canBeShaded(state) ? state.depthShading : 0;
    this.shading.sync(drawn, strength, clip, lamp);
    this.frame.uDensity.value = state !== null && isTraced(state) ? state.trace.density : 1;
    for (const { march } of drawn) {
      this.shading.place(march);
      march.setShaded(this.frame.uDepthShading.value > 0);
      march.sortBy(eye);
      march.aim(apex, axis);
      march.clip(clip);
      march.shareWith(boxes.min, boxes.max, boxes.count);
    }
  }

  /** Forgets GPU resources beside those of the residents. */
  forget(): void {
    this.shading.forget();
  }

  dispose(): void {
    this.occupancy.dispose();
    this.cells.dispose();
    this.shading.dispose();
  }
}

function volumeOf(
  { channels: [channel], index }: Packed,
  { texture }: Resident,
): TileVolume | null {
  const source = texture.kept.get(channel);
  if (source === undefined) return null;
  return index === null ? source.volume : volumeOfBricks(source.volume);
}

/** The box around several marched tiles, um, world. */
class Bounds {
  readonly min = new Vector3().setScalar(Number.POSITIVE_INFINITY);
  readonly max = new Vector3().setScalar(Number.NEGATIVE_INFINITY);
  count = 0;

  add(march: TileMarch): void {
    march.growBox(this.min, this.max);
    this.count++;
  }
}
