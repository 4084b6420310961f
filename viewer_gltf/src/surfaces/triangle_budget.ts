/** Makes surfaces coarser if those in view have more triangles than the device can draw in time. */

/**
 * The levels of detail of a tile in view, coarsest first: for each, its error on screen (infinite
 * at the eye) and its number of triangles.
 */
export type Levels = readonly Readonly<{ error_px: number; triangles: number }>[];

/**
 * `factor`: factor of the requested error. `leftOut`: number of finest levels that are never used.
 */
export type Coarser = Readonly<{ factor: number; leftOut: number }>;

const FACTORS = [1, Math.SQRT2, 2, 2 * Math.SQRT2, 4] as const;
/**
 * Number of choices of how many of the finest levels of detail are left out; tiles have fewer
 * levels.
 */
const MAX_LEVELS = 8;
/**
 * All choices of how much coarser surfaces are drawn, finest first; the first choice changes
 * nothing.
 */
const ALL: readonly Coarser[] = Array.from({ length: MAX_LEVELS }, (_, leftOut) =>
  FACTORS.map((factor) => ({ factor, leftOut })),
).flat();
export const [FINEST] = ALL;
/** Share of the budget that a finer choice must not exceed, so that levels do not alternate. */
const HEADROOM = 0.8;

/** Estimated number of triangles if each tile is refined to an error. */
export function trianglesAt(
  tiles: readonly Levels[],
  target_px: number,
  { factor, leftOut }: Coarser = FINEST,
): number {
  return tiles.reduce((sum, levels) => {
    const had = levels.slice(0, Math.max(1, levels.length - leftOut));
    const drawn = had.find(({ error_px }) => error_px <= factor * target_px) ?? had.at(-1);
    return sum + (drawn?.triangles ?? 0);
  }, 0);
}

/**
 * Returns how much coarser the surfaces must be to stay within `most` triangles; the coarsest
 * choice if none does.
 */
export function coarserFor(
  tiles: readonly Levels[],
  target_px: number,
  most: number,
  before: Coarser,
): Coarser {
  const usual = ALL.indexOf(before);
  const fits = (each: Coarser, i: number) =>
    trianglesAt(tiles, target_px, each) <= (i < usual ? HEADROOM : 1) * most;
  return ALL.find(fits) ?? ALL[ALL.length - 1];
}
