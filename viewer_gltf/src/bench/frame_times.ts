/** What a run's frames come to. Pure. */

export type FrameTimes = Readonly<{
  frames: number;
  /** Between two frames, ms. */
  median_ms: number;
  p95_ms: number;
  longest_ms: number;
  /** Frames a second, by the median. */
  fps: number;
}>;

/** Of the times at which frames were drawn, ms, in order; null: fewer than two. */
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

/** Between the two nearest, as numpy's default. */
function quantile(sorted: readonly number[], share: number): number {
  const at = share * (sorted.length - 1);
  const [low, high] = [Math.floor(at), Math.ceil(at)];
  return sorted[low] + (at - low) * (sorted[high] - sorted[low]);
}

/** Hundredths: no clock of a browser tells more. */
function rounded(value: number): number {
  return Math.round(100 * value) / 100;
}
