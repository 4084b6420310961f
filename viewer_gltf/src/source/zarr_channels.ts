/** Chooses the channels of an OME-Zarr image that are read, and collects their metadata. */
import type { CoarseVolume } from "./coarse_volume";
import type { NgffChannel } from "./ngff";
import type { ImageChannel } from "./opened_image";

/** Largest number of channels that are read. */
const MAX_CHANNELS = 8;

/** Returns the indices of the channels to show, in the order of the source. Active channels are preferred. */
export function chooseChannels(stated: readonly NgffChannel[], total: number): readonly number[] {
  const all = Array.from({ length: total }, (_, i) => i);
  const isActive = (i: number) => stated[i]?.active !== false;
  return [...all.filter(isActive), ...all.filter((i) => !isActive(i))]
    .slice(0, MAX_CHANNELS)
    .sort((a, b) => a - b);
}

export function channelsOf(
  stated: readonly NgffChannel[],
  chosen: readonly number[],
  dtype: string,
  read: (index: number, onShare?: (share: number) => void) => Promise<CoarseVolume>,
): readonly ImageChannel[] {
  const names = unique(chosen.map((index) => stated[index]?.label ?? `Channel${index}`));
  const areNone = chosen.every((index) => stated[index]?.active === false);
  return chosen.map((index, i) => ({
    name: names[i],
    color: stated[index]?.color ?? null,
    window: usefulWindow(stated[index]?.window ?? null, dtype),
    opens: areNone || stated[index]?.active !== false,
    read: (onShare) => read(index, onShare),
  }));
}

/** Returns a stated window; null if it is the whole range of the type, which some writers state in place of none. */
function usefulWindow(window: NgffChannel["window"], dtype: string): NgffChannel["window"] {
  const bits = Number(/^u?int(\d+)$/.exec(dtype)?.[1] ?? 0);
  const isWhole = window !== null && bits > 8 && window[1] - window[0] >= 2 ** bits - 1;
  return isWhole ? null : window;
}

/** Longest name of a channel, characters. */
const LONGEST_NAME = 60;

/**
 * Makes names unique: a name that occurs more than once gets the channel's index, counted from 0,
 * as in a build.
 */
function unique(stated: readonly string[]): readonly string[] {
  const names = stated.map((name) => name.slice(0, LONGEST_NAME));
  const counts = new Map<string, number>();
  for (const name of names) {
    counts.set(name.toLowerCase(), (counts.get(name.toLowerCase()) ?? 0) + 1);
  }
  return names.map((name, i) =>
    counts.get(name.toLowerCase()) === 1 ? name : `${name} (channel ${i})`,
  );
}
