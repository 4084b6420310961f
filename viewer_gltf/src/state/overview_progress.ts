/** Loading progress of the overview: the coarsest LOD of every tile of the shown channels. Pure. */
export type TileProgress = Readonly<{
  /** Number of coarsest tiles with content; null until the tileset has arrived. */
  total: number | null;
  /** Number of coarsest tiles that are loaded or have failed. */
  done: number;
}>;

export type Progress = Readonly<{ done: number; total: number; isComplete: boolean }>;

/** Returns the sum over tilesets. A tileset that has not arrived counts as one missing tile. */
export function overview(tilesets: readonly TileProgress[]): Progress {
  const total = tilesets.reduce((sum, tileset) => sum + (tileset.total ?? 1), 0);
  const done = tilesets.reduce((sum, tileset) => sum + tileset.done, 0);
  return { done, total, isComplete: done >= total };
}
