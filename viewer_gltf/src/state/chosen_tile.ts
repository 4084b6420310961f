/** The effect of choosing a tile. Pure. */
import type { ViewerState } from "./viewer_state";

/** Selects a tile; chosen again, isolates it; once more, shows all. */
export function chosenTile({ selected, isolated }: ViewerState, tile: string) {
  if (isolated === tile) return { type: "isolate", tile: null } as const;
  if (isolated !== null || selected === tile) return { type: "isolate", tile } as const;
  return { type: "select", tile } as const;
}
