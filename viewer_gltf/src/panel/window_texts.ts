/** A channel's window in the values of the source. Pure. */
import { valueText } from "../probe/measure";

/** The voxel values of the source that are 0 and 255 in a volume, and their unit, where there is one. */
export type Range = readonly [start: number, end: number, unit?: string];
/** By channel. */
export type Ranges = ReadonlyMap<string, Range>;

/** A share of the intensities as the source counts them. */
export function intensityText(share: number, range: Range | undefined): string {
  if (range === undefined) return `${Math.round(100 * share)} %`;
  const [start, end] = range;
  return valueText(start + (end - start) * share, [start, end]);
}

/** Both ends of a window, the unit behind the upper one. */
export function windowTexts(
  [low, high]: readonly [number, number],
  range: Range | undefined,
): readonly [string, string] {
  const unit = range?.[2] ?? "";
  return [intensityText(low, range), `${intensityText(high, range)} ${unit}`.trim()];
}
