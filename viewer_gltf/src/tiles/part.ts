/** The choice of a tile, as a part of the viewer. */
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { PartSection } from "../panel/controls";
import { TILE_KEYS } from "./keys";
import { tileSections } from "./section";

class TilesPart implements Part {
  readonly id = "tiles";

  constructor(private readonly host: PartHost) {}

  panel(): readonly PartSection[] {
    const { state, focus } = this.host;
    return tileSections(state, focus.focusTiles.focusTile);
  }

  dispose(): void {}
}

export const tiles: PartDefinition = {
  id: "tiles",
  keys: TILE_KEYS,
  create: (host) => new TilesPart(host),
};
