/**
 * What a change of the state has brought that nobody asked for and that is no fault, in words that go
 * by themselves. Pure.
 */

import { isCutAway } from "../math/clip";
import type { BoxedTile } from "../math/pick";
import { tileName } from "./tile_name";
import { MAX_CHANNELS, type ViewerState } from "./viewer_state";

/** null: nothing. */
export function announcementOf(
  before: ViewerState,
  after: ViewerState,
  tiles: readonly BoxedTile[],
): string | null {
  return channelLeft(before, after) ?? nothingLeft(before, after, tiles);
}

/** One came, and another had to leave for it. */
function channelLeft(before: ViewerState, after: ViewerState): string | null {
  if (before.channels === after.channels) return null;
  const come = after.channels.find(({ shown }, i) => shown && !before.channels[i].shown);
  const left = after.channels.find(({ shown }, i) => !shown && before.channels[i].shown);
  if (come === undefined || left === undefined) return null;
  return `${MAX_CHANNELS} channels show at once: ${left.name} left for ${come.name}.`;
}

/** The picture is empty, since the cuts have taken the only tile that is shown. */
function nothingLeft(
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
  return `Only ${tileName(isolated ?? "", after.tiles)}: the cut leaves nothing of it.`;
}
