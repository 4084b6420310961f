/**
 * Tiles whose volumes are on the GPU: how much memory each may use, how far it has faded in, and
 * when it is removed.
 */
import type { WantedTile } from "../state/representation";
import type { BrickTile } from "../voxels/bricks/brick_atlas";
import type { SharpenedTile } from "../voxels/bricks/sharpened_tile";
import type { Packed, TileTexture } from "../voxels/tile_texture";
import type { TileMarch } from "./tile_raymarch";

/** Seconds in which a loaded volume fades in, or a removed one fades out. */
const PRESENCE_S = 0.25;
/** Number of tiles that stay for a while after the gaze has left them, since it often returns. */
const KEPT_TILES = 2;
/**
 * Factor for the bytes of a mip level together with the next coarser one; both stay during a fade.
 */
const WITH_OLD_LEVEL = 9 / 8;

export type Resident = {
  readonly texture: TileTexture | BrickTile | SharpenedTile;
  march: TileMarch | null;
  /** Source of the march's tables. */
  packed: Packed | null;
  wanted: WantedTile | null;
  /** How far the volumes of the tile have faded in, 0 to 1. */
  presence: number;
  /** Number of the request in which the tile was last wanted; larger is more recent. */
  turn: number;
};

export class Residency {
  private readonly residents = new Map<string, Resident>();
  private turn = 0;

  /** @param budget bytes of GPU memory for all tiles */
  constructor(private readonly budget: number) {}

  get all(): readonly Resident[] {
    return [...this.residents.values()];
  }

  get byTile(): readonly (readonly [string, Resident])[] {
    return [...this.residents];
  }

  /** Bytes on the GPU. */
  get bytes(): number {
    return this.all.reduce((sum, { texture }) => sum + texture.bytes, 0);
  }

  get(tile: string): Resident | undefined {
    return this.residents.get(tile);
  }

  add(tile: string, texture: Resident["texture"]): Resident {
    const resident = { texture, march: null, packed: null, wanted: null, presence: 0, turn: 0 };
    this.residents.set(tile, resident);
    return resident;
  }

  /** Returns the GPU memory, in bytes, that one tile may use if `wanted` tiles are needed. */
  share(wanted: number): number {
    return this.budget / (WITH_OLD_LEVEL * (wanted + KEPT_TILES));
  }

  /** Marks all tiles as not wanted, until they are requested again. */
  clearWanted(): void {
    this.turn++;
    for (const resident of this.residents.values()) resident.wanted = null;
  }

  want(resident: Resident, wanted: WantedTile): void {
    resident.wanted = wanted;
    resident.turn = this.turn;
  }

  /** How far the volume of a channel in a tile has faded in, 0 to 1. */
  presence(tile: string, channel: string): number {
    const resident = this.residents.get(tile);
    if (resident === undefined || resident.march === null) return 0;
    return resident.packed?.channels.includes(channel) ? resident.presence : 0;
  }

  /**
   * Advances all fades, including those between mip levels. Returns whether any is still going on.
   */
  advance(dt_s: number): boolean {
    let isFading = false;
    for (const resident of this.residents.values()) {
      isFading = resident.texture.advance(dt_s) || isFading;
      const goal = resident.wanted !== null && resident.march !== null ? 1 : 0;
      const step = dt_s / PRESENCE_S;
      const { presence } = resident;
      resident.presence =
        goal > presence ? Math.min(1, presence + step) : Math.max(goal, presence - step);
      if (resident.presence !== goal) isFading = true;
      else if (presence !== goal && goal === 0) this.evict();
    }
    return isFading;
  }

  /**
   * Removes tiles that are no longer wanted and have faded out, except for the few wanted most
   * recently.
   */
  evict(): void {
    const idle = this.byTile.filter(([, { wanted, presence }]) => !wanted && presence === 0);
    idle.sort(([, a], [, b]) => b.turn - a.turn);
    for (const [, resident] of idle) resident.texture.want(new Map(resident.texture.kept), []);
    const leaving = this.all.filter(({ wanted, presence }) => !wanted && presence > 0);
    for (const [tile] of idle.slice(Math.max(0, KEPT_TILES - leaving.length))) this.drop(tile);
  }

  drop(tile: string): void {
    const resident = this.residents.get(tile);
    resident?.march?.dispose();
    resident?.texture.dispose();
    this.residents.delete(tile);
  }

  dropAll(): void {
    for (const tile of [...this.residents.keys()]) this.drop(tile);
  }
}
