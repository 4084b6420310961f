/** Sweeps over many cases: `make test-exhaustive` runs all of them, `make test` one of each kind. */
export const IS_EXHAUSTIVE = Boolean(process.env.STEREOCELL_EXHAUSTIVE);

/** Returns all cases of a sweep, or those that are part of every run. */
export function sweep<T>(cases: readonly T[], isKept: (each: T) => boolean): readonly T[] {
  const kept = cases.filter(isKept);
  if (kept.length === 0) throw new Error("a sweep needs a case that is part of every run");
  return IS_EXHAUSTIVE ? cases : kept;
}
