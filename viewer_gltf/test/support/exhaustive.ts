/** Sweeps: `make test-exhaustive` runs them whole, `make test` one of each kind. */
export const IS_EXHAUSTIVE = Boolean(process.env.STEREOCELL_EXHAUSTIVE);

/** All cases of a sweep, or those of its kinds that are kept for every run. */
export function sweep<T>(cases: readonly T[], isKept: (each: T) => boolean): readonly T[] {
  const kept = cases.filter(isKept);
  if (kept.length === 0) throw new Error("of a sweep at least one case is kept");
  return IS_EXHAUSTIVE ? cases : kept;
}
