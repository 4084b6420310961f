/** Coarser surfaces where those in view would have more triangles than a device draws in time. Pure. */

/** The levels of a tile in view, coarsest first: its error on screen, infinite at the eye, and its triangles. */
export type Levels = readonly Readonly<{ error_px: number; triangles: number }>[];

/** `factor`: to the error that is asked for. `leftOut`: finest levels that no tile has, however near. */
export type Coarser = Readonly<{ factor: number; leftOut: number }>;

const FACTORS = [1, Math.SQRT2, 2, 2 * Math.SQRT2, 4] as const;
/** More than tiles have levels. */
const MAX_LEVELS = 8;
/** Finest first; the first asks for nothing coarser. */
const ALL: readonly Coarser[] = Array.from({ length: MAX_LEVELS }, (_, leftOut) =>
  FACTORS.map((factor) => ({ factor, leftOut })),
).flat();
export const [FINEST] = ALL;
/** Share of the budget within which what is finer has to stay: else levels would change to and fro. */
const ROOM = 0.8;

/** About how many are drawn where each tile is refined down to an error. */
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

/** By how much they are coarser, to be at most so many; by as much as can be where all are more. */
export function coarserFor(
  tiles: readonly Levels[],
  target_px: number,
  most: number,
  before: Coarser,
): Coarser {
  const usual = ALL.indexOf(before);
  const fits = (each: Coarser, i: number) =>
    trianglesAt(tiles, target_px, each) <= (i < usual ? ROOM : 1) * most;
  return ALL.find(fits) ?? ALL[ALL.length - 1];
}
