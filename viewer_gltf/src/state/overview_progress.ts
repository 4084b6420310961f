/** How far the overview has come: the coarsest LOD of every tile of the shown channels. Pure. */
export type TileProgress = Readonly<{
  /** Coarsest tiles with content; null until the tileset has arrived. */
  total: number | null;
  /** Of these, loaded or given up. */
  done: number;
}>;

export type Progress = Readonly<{ done: number; total: number; isComplete: boolean }>;

/** The sum over tilesets. A tileset that is not there yet counts as one tile to come. */
export function overview(tilesets: readonly TileProgress[]): Progress {
  const total = tilesets.reduce((sum, tileset) => sum + (tileset.total ?? 1), 0);
  const done = tilesets.reduce((sum, tileset) => sum + tileset.done, 0);
  return { done, total, isComplete: done >= total };
}
