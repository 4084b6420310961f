/** What is on screen, as a measurement reads it. Surfaces and volumes report it themselves. */
import type { Mesh } from "three";
import type { TileVolume } from "../bundle/generated/volumes";

export type ShownSurface = Readonly<{ mesh: Mesh; tile: string; channel: string }>;

/** Mip levels of a volume file, still compressed. */
export type LevelSource = Readonly<{
  volume: TileVolume;
  /** Whether a level needs no fetching. */
  has(index: number): boolean;
  level(index: number, signal: AbortSignal): Promise<Uint8Array>;
}>;

/** A channel of a tile. */
export type ShownVolume = Readonly<{
  tile: string;
  channel: string;
  /** 256 RGBA entries: opacities of a voxel's length. */
  table: Uint8Array;
  isInDisc: boolean;
  source: LevelSource;
}>;
