/** Chooses whether each channel is drawn as a surface or as a volume in each tile. Pure. */

import { VOLUME_TILES_AT_START } from "./initial_state";
import { isTraced } from "./parameters/volumes";
import {
  type ChannelState,
  type Representation,
  type TileState,
  type ViewerState,
  volumeChannels,
} from "./viewer_state";

/** Tiles that are near enough to be drawn as volumes. */
export type FocusTiles = Readonly<{
  /** Tile in the middle of the view. */
  focusTile: string | null;
  /** First tiles that the rays of the focus disc meet, the gazed tile first. */
  disc: readonly string[];
  /** All tiles within the volume distance. */
  near: ReadonlySet<string>;
}>;

export const NO_FOCUS: FocusTiles = { focusTile: null, disc: [], near: new Set() };

/** A tile whose volume is needed, and its channels in the order of the bundle. */
export type WantedTile = Readonly<{
  tile: string;
  channels: readonly string[];
}>;

/** The tile that volumes follow: the selected tile, or the gazed one. */
function focusTileOf(state: ViewerState, focusTiles: FocusTiles): string | null {
  return state.selected ?? focusTiles.focusTile;
}

/** Returns whether a channel has no clear surface, so that it is drawn as a volume wherever possible. */
function prefersVolume(channel: ChannelState): boolean {
  return !channel.hasSurface && channel.surfaceReason !== "";
}

/** Returns how a channel is drawn in a tile once all is loaded; null: not at all. */
export function representationOf(
  state: ViewerState,
  channel: ChannelState,
  tile: TileState,
  focusTiles: FocusTiles,
): Representation | null {
  if (!channel.shown || (state.isolated !== null && tile.id !== state.isolated)) return null;
  if (!channel.volume || state.mode === "off") return "mesh";
  if (tile.isUnfinished) return "volume"; // its surfaces are not built yet, and its volume is small
  if (state.mode === "stage" && tile.representation !== "mesh") return tile.representation;
  if (isTraced(state) || isMarched(state, tile.id, focusTiles)) return "volume";
  if (!prefersVolume(channel)) return "mesh";
  const isSmall = state.tiles.length <= VOLUME_TILES_AT_START;
  return isSmall || tile.id === (focusTileOf(state, focusTiles) ?? state.middle) ? "volume" : null;
}

function isMarched(state: ViewerState, tile: string, focusTiles: FocusTiles): boolean {
  switch (state.mode) {
    case "tile":
      return tile === marchedTile(state, focusTiles);
    case "disc":
      return !isUnfinished(state) && focusTiles.disc.includes(tile);
    case "all":
      return true;
    case "stage":
    case "traced":
    case "off":
      return false;
  }
}

/** Returns the only tile that is a volume among surfaces; null: none. */
export function marchedTile(state: ViewerState, focusTiles: FocusTiles): string | null {
  const tile = focusTileOf(state, focusTiles);
  return state.mode === "tile" && tile !== null && focusTiles.near.has(tile) ? tile : null;
}

/** Returns whether a channel's volumes are drawn only in the focus disc, round the middle of the view. */
export function isInDisc(state: ViewerState, channel: ChannelState): boolean {
  return state.mode === "disc" && !prefersVolume(channel) && !isUnfinished(state);
}

/**
 * Returns whether the surfaces of some tile are not built yet, so that its volume is shown instead.
 * The focus disc then cuts no hole into surfaces.
 */
function isUnfinished({ tiles }: ViewerState): boolean {
  return tiles.some((tile) => tile.isUnfinished);
}

/**
 * Returns the tiles whose volumes are needed, those in the disc first. Path tracing marches them
 * until its own volume is loaded.
 */
export function wantedTiles(state: ViewerState, focusTiles: FocusTiles): readonly WantedTile[] {
  const channels = volumeChannels(state);
  const wanted = state.tiles.flatMap((tile) => {
    const drawn = channels.filter((channel) => {
      const as = representationOf(state, channel, tile, focusTiles);
      return as === "volume" || as === "both";
    });
    if (drawn.length === 0) return [];
    return [
      {
        tile: tile.id,
        channels: drawn.map(({ id }) => id),
      },
    ];
  });
  const rank = (id: string) => {
    const place = focusTiles.disc.indexOf(id);
    return place === -1 ? focusTiles.disc.length : place;
  };
  return wanted.sort((a, b) => rank(a.tile) - rank(b.tile));
}

/** Returns whether surfaces of a channel are drawn anywhere. If not, they are not loaded. */
export function wantsSurface(state: ViewerState, channel: ChannelState): boolean {
  if (!channel.shown) return false;
  if (channel.volume && isTraced(state)) return false;
  if (!channel.volume || !prefersVolume(channel) || state.mode === "off") return true;
  return state.mode === "stage" && state.tiles.some((tile) => tile.representation === "both");
}

/** Returns the share of a tile's surface that its volume hides, 0..1; null: the surface is not drawn. */
export function hiddenShare(
  state: ViewerState,
  channel: ChannelState,
  tile: TileState,
  focusTiles: FocusTiles,
  presence: number,
): number | null {
  const as = representationOf(state, channel, tile, focusTiles);
  if (as === null || (as === "volume" && (prefersVolume(channel) || isTraced(state)))) return null;
  return as === "both" ? 0 : presence;
}
