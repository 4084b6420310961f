/** The keys of the tiles. Pure. */

import { type Key, type KeyGroup, key, neighbour, no } from "../panel/key";
import { chosenTile } from "../state/chosen_tile";
import { setTo } from "../state/parameters/kinds";
import { SCREEN_STEREO } from "../state/parameters/tools";
import { REFUSED } from "../state/refusals";

function nextTile(by: number): Key["to"] {
  return ({ state }) => {
    const ids = state.tiles.map(({ id }) => id);
    const tile = neighbour(ids, state.isolated ?? state.selected ?? undefined, by);
    if (tile === null) return no(REFUSED.tileAhead);
    return state.isolated === null ? { type: "select", tile } : { type: "isolate", tile };
  };
}

const KEYS: readonly Key[] = [
  key("t", "Next tile", nextTile(1)),
  key("T", "Previous tile", nextTile(-1)),
  key(
    "i",
    "Show only the selected tile, or the tile in the gaze; again: show all tiles",
    (context) => {
      const { state, focusTile } = context;
      if (state.isolated !== null) return { type: "isolate", tile: null };
      const tile = state.selected ?? focusTile;
      if (tile === null) return no(REFUSED.tile);
      return { type: "isolate", tile };
    },
  ),
  key("g", "Select the tile in the gaze; again: show only this tile", ({ state, focusTile }) =>
    focusTile === null ? no(REFUSED.tileAhead) : chosenTile(state, focusTile),
  ),
  key(
    ["Escape", "Backspace"],
    "Back: end stereo, show all tiles, then clear the selection",
    ({ state }) => {
      if (state.screenStereo !== "off") return setTo(SCREEN_STEREO, "off");
      const isChosen = state.isolated !== null || state.selected !== null;
      return isChosen ? "back" : no(REFUSED.back);
    },
  ),
];

export const TILE_KEYS: readonly KeyGroup[] = [{ name: "Tiles", rank: 70, keys: KEYS }];
