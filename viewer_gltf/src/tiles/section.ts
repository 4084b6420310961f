/** The section of the tiles on the panel: a map by row and column, or a list. Pure. */

import { command } from "../panel/control_templates";
import type { Control, PartSection } from "../panel/controls";
import { chosenTile } from "../state/chosen_tile";
import { REFUSED } from "../state/refusals";
import { tileName, tileTitle } from "../state/tile_name";
import type { ViewerState } from "../state/viewer_state";
import { tileGrid } from "./tile_grid";

function tileItems(state: ViewerState, focusTile: string | null): readonly Control[] {
  const { selected, isolated } = state;
  const grid = tileGrid(state.tiles.map(({ id }) => id));
  const items: Control[] = [];
  if (grid === null) {
    items.push({
      kind: "choice",
      id: "tile-choice",
      label: "Tile",
      value: isolated ?? selected ?? "",
      options: [
        { value: "", label: "by gaze" },
        ...state.tiles.map(({ id }) => ({
          value: id,
          label: `${tileName(id, state.tiles)}${id === focusTile ? " (in the gaze)" : ""}`,
        })),
      ],
      isInline: false,
      to: (id) => (id === "" ? { type: "select", tile: null } : chosenTile(state, id)),
    });
  } else {
    items.push({
      kind: "map",
      id: "tile-map",
      label: "Tiles by row and column",
      rows: grid.rows,
      columns: grid.columns,
      tiles: grid.cells.map((cell) => ({
        ...cell,
        name: tileName(cell.id, state.tiles),
        title: tileTitle(cell.id, state.tiles),
        isFocus: cell.id === focusTile,
        isSelected: cell.id === selected,
        isIsolated: cell.id === isolated,
      })),
      to: (id) => chosenTile(state, id),
    });
  }
  const alone = isolated ?? selected ?? focusTile;
  items.push(
    {
      kind: "toggle",
      id: "isolate",
      label: `Show only ${isolated === null ? "this tile" : tileName(isolated, state.tiles)}`,
      value: isolated !== null,
      refusal: alone === null ? REFUSED.tile : "",
      to: (value) => ({ type: "isolate", tile: value ? alone : null }),
    },
    {
      ...command("back", "Back"),
      refusal: selected === null && isolated === null ? REFUSED.back : "",
    },
  );
  return items;
}

/** Returns the section of the tiles; an empty list if the specimen has only one tile. */
export function tileSections(state: ViewerState, focusTile: string | null): readonly PartSection[] {
  if (state.tiles.length < 2) return [];
  return [{ rank: 40, id: "tiles", label: "Tiles", items: tileItems(state, focusTile) }];
}
