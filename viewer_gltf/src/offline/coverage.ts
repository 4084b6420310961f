/**
 * Computes how much of a specimen a visit without a network would show. A tile counts if it is kept
 * at the finest level of detail that was shown anywhere, since a user expects to find that level
 * everywhere. Pure.
 */
import { type Asked, keyOf } from "../bundle/request_log";

/** The requests for each level of one tile, the finest level first. */
export type Levels = Readonly<{ tile: string; levels: readonly (readonly Asked[])[] }>;
/** The surfaces of one channel, or its volumes. */
export type Layer = readonly Levels[];

export type Coverage = Readonly<{
  /** Number of tiles that are kept at the finest level of detail that was shown. */
  tiles: number;
  /** Whether the host makes the shown volumes for each view, so that none of them can be kept. */
  isByView?: boolean;
}>;

/**
 * Counts the tiles that are kept in all layers.
 *
 * @param answered the requests that were answered
 * @param kept keys of the requests that need no network
 */
export function coverageOf(
  tiles: readonly string[],
  layers: readonly Layer[],
  answered: readonly Asked[],
  kept: ReadonlySet<string>,
): Coverage {
  const shown = new Set(answered.map(keyOf));
  const hasAll = (asked: readonly Asked[], keys: ReadonlySet<string>) =>
    asked.every((each) => keys.has(keyOf(each)));
  const missing = new Set<string>();
  for (const layer of layers) {
    const finest = layer
      .map(({ levels }) => levels.findIndex((asked) => hasAll(asked, shown)))
      .filter((index) => index >= 0);
    if (finest.length === 0) continue; // the layer was never shown
    const wanted = Math.min(...finest);
    for (const { tile, levels } of layer) {
      const asked = levels[Math.min(wanted, levels.length - 1)] ?? [];
      if (!hasAll(asked, kept)) missing.add(tile);
    }
  }
  return { tiles: tiles.filter((tile) => !missing.has(tile)).length };
}

const MORE = "A tile is also kept once you have looked at it from near.";
const BY_VIEW = "This host sends volumes for each view, so volumes need the network.";

/** Returns the sentences that the page announces: how much is kept, and why not more. */
export function coverageText({ tiles, isByView = false }: Coverage, of: number): string {
  if (tiles === of)
    return "Ready offline: the whole specimen opens without a network, as detailed as you have seen it.";
  const places = tiles === 0 ? "" : ` and ${tiles} of ${of} tiles`;
  return `Kept for offline: the overview${places}. ${isByView ? BY_VIEW : MORE}`;
}
