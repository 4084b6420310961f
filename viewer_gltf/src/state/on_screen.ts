/**
 * Surfaces and volumes that are on screen, as measuring reads them. The surfaces and volumes report
 * themselves.
 */
import type { Mesh } from "three";
import type { TileVolume } from "../bundle/generated/volumes";

export type ShownSurface = Readonly<{ mesh: Mesh; tile: string; channel: string }>;

/** Mip levels of a volume file, still compressed. */
export type LevelSource = Readonly<{
  volume: TileVolume;
  /** Returns whether a mip level is available without fetching. */
  has(index: number): boolean;
  level(index: number, signal: AbortSignal): Promise<Uint8Array>;
}>;

/** Volume of one channel in one tile. */
export type ShownVolume = Readonly<{
  tile: string;
  channel: string;
  /** 256 RGBA entries; opacity is per length of one voxel. */
  table: Uint8Array;
  isInDisc: boolean;
  source: LevelSource;
}>;
