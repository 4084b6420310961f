/** The effect of choosing a tile. Pure. */
import type { ViewerState } from "./viewer_state";

/**
 * Returns the action of choosing a tile: the first choice selects it, the second isolates it, the
 * third shows all tiles.
 */
export function chosenTile({ selected, isolated }: ViewerState, tile: string) {
  if (isolated === tile) return { type: "isolate", tile: null } as const;
  if (isolated !== null || selected === tile) return { type: "isolate", tile } as const;
  return { type: "select", tile } as const;
}
