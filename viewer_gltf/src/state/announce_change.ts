/**
 * Announcements of what a change of the state did beyond the user's request, although nothing
 * failed. The page shows them for a moment. Pure.
 */

import { isCutAway } from "../math/clip";
import type { BoxedTile } from "../math/pick";
import { tileName } from "./tile_name";
import { MAX_CHANNELS, type ViewerState } from "./viewer_state";

/** Returns the announcement of a change; null if there is none. */
export function announcementOf(
  before: ViewerState,
  after: ViewerState,
  tiles: readonly BoxedTile[],
): string | null {
  return replacedChannel(before, after) ?? emptiedTile(before, after, tiles);
}

/** Announces that a channel was hidden to make room for another. */
function replacedChannel(before: ViewerState, after: ViewerState): string | null {
  if (before.channels === after.channels) return null;
  const added = after.channels.find(({ shown }, i) => shown && !before.channels[i].shown);
  const removed = after.channels.find(({ shown }, i) => !shown && before.channels[i].shown);
  if (added === undefined || removed === undefined) return null;
  return `At most ${MAX_CHANNELS} channels can be shown at once: ${removed.name} was hidden to show ${added.name}.`;
}

/** Announces that nothing is shown because the cuts remove all of the isolated tile. */
function emptiedTile(
  before: ViewerState,
  after: ViewerState,
  tiles: readonly BoxedTile[],
): string | null {
  const { isolated, clip } = after;
  if (isolated === before.isolated && clip === before.clip) return null;
  const isEmpty = (state: ViewerState) => {
    const tile = tiles.find(({ id }) => id === state.isolated);
    return tile !== undefined && isCutAway(tile.bounds_um, state.clip);
  };
  if (!isEmpty(after) || (isolated === before.isolated && isEmpty(before))) return null;
  return `Only ${tileName(isolated ?? "", after.tiles)} is shown, and the cut removes all of it.`;
}
