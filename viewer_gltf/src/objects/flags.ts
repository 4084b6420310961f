/** Flags that say whether each object is shown, and how strongly it is lit: one byte for each row. Pure. */
import { ALL_BYTES, type ObjectView } from "../state/objects";

export const GONE = 0;
export const PLAIN = 1;
export const NEIGHBOUR = 2;
export const SELECTED = 3;
export const PICKED = 4;

/** Returns a column's bytes; null: they are still loading. */
type BytesOf = (column: string) => Uint8Array | null;

/** Returns the IDs of the columns whose filters may hide objects. */
export function filtered({ ranges, without }: ObjectView): readonly string[] {
  const narrowed = Object.keys(ranges).filter((id) => !isWhole(ranges[id]));
  return [...narrowed, ...Object.keys(without).filter((id) => without[id].length > 0)];
}

function isWhole([low, high]: readonly [number, number]): boolean {
  return low <= ALL_BYTES[0] && high >= ALL_BYTES[1];
}

/** Writes the flag of each row into `flags`, and returns the number of shown objects. */
export function flag(
  flags: Uint8Array,
  view: ObjectView,
  bytesOf: BytesOf,
  neighbours: ArrayLike<number>,
): number {
  flags.fill(view.only === null ? PLAIN : GONE);
  for (const row of view.only ?? []) if (row < flags.length) flags[row] = PLAIN;
  for (const row of view.hidden) flags[row] = GONE;
  for (const [id, range] of Object.entries(view.ranges)) {
    const bytes = isWhole(range) ? null : bytesOf(id);
    if (bytes === null) continue;
    const [low, high] = range;
    for (let row = 0; row < flags.length; row++) {
      if (bytes[row] < low || bytes[row] > high) flags[row] = GONE;
    }
  }
  for (const [id, gone] of Object.entries(view.without)) {
    const bytes = gone.length === 0 ? null : bytesOf(id);
    if (bytes === null) continue;
    const isGone = new Set(gone);
    for (let row = 0; row < flags.length; row++) if (isGone.has(bytes[row] - 1)) flags[row] = GONE;
  }
  const light = (row: number, as: number) => {
    if (row < flags.length && flags[row] !== GONE) flags[row] = as;
  };
  for (let i = 0; i < neighbours.length; i++) light(neighbours[i], NEIGHBOUR);
  for (const row of view.selected) light(row, SELECTED);
  if (view.picked !== null) light(view.picked, PICKED);
  let left = 0;
  for (const each of flags) if (each !== GONE) left++;
  return left;
}
