/** Summarises the times of a run's frames. Pure. */

export type FrameTimes = Readonly<{
  frames: number;
  /** Median of the times between two frames, ms. */
  median_ms: number;
  p95_ms: number;
  longest_ms: number;
  /** Frames per second by the median. */
  fps: number;
}>;

/** Summarises the times at which frames were drawn, ms, in ascending order; null if there are fewer than two frames. */
export function summarise(drawnAt_ms: readonly number[]): FrameTimes | null {
  const between = drawnAt_ms.slice(1).map((time, i) => time - drawnAt_ms[i]);
  if (between.length === 0) return null;
  const sorted = [...between].sort((a, b) => a - b);
  const median_ms = quantile(sorted, 0.5);
  return {
    frames: between.length,
    median_ms: rounded(median_ms),
    p95_ms: rounded(quantile(sorted, 0.95)),
    longest_ms: rounded(sorted[sorted.length - 1]),
    fps: rounded(1000 / Math.max(median_ms, 1e-3)),
  };
}

/** Returns a quantile by linear interpolation, like numpy's default. */
function quantile(sorted: readonly number[], share: number): number {
  const at = share * (sorted.length - 1);
  const [low, high] = [Math.floor(at), Math.ceil(at)];
  return sorted[low] + (at - low) * (sorted[high] - sorted[low]);
}

/** Rounds to hundredths; the clocks of browsers are not more precise. */
function rounded(value: number): number {
  return Math.round(100 * value) / 100;
}
