/** The window of a channel in the values of the source. Pure. */
import { valueText } from "../probe/measure";

/** Voxel values of the source that are 0 and 255 in a volume, and their unit, if any. */
export type Range = readonly [start: number, end: number, unit?: string];
/** By channel, the voxel values of the source that are 0 and 255 in a volume. */
export type Ranges = ReadonlyMap<string, Range>;

/** Returns a share of the intensities as a value of the source; in percent if the range is unknown. */
export function intensityText(share: number, range: Range | undefined): string {
  if (range === undefined) return `${Math.round(100 * share)} %`;
  const [start, end] = range;
  return valueText(start + (end - start) * share, [start, end]);
}

/** Returns both ends of a window, with the unit after the upper one. */
export function windowTexts(
  [low, high]: readonly [number, number],
  range: Range | undefined,
): readonly [string, string] {
  const unit = range?.[2] ?? "";
  return [intensityText(low, range), `${intensityText(high, range)} ${unit}`.trim()];
}
