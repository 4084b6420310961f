/** The representation of each channel and tile: surface or volume. Pure. */

import { VOLUME_TILES_AT_START } from "./initial_state";
import { isTraced } from "./parameters/volumes";
import {
  type ChannelState,
  type Representation,
  type TileState,
  type ViewerState,
  volumeChannels,
} from "./viewer_state";

/** What lies near enough to be drawn as a volume. */
export type FocusTiles = Readonly<{
  /** The tile that the view's centre looks at. */
  focusTile: string | null;
  /** The tiles that the disc round the gaze meets first, the gazed one first. */
  disc: readonly string[];
  /** All tiles within the switch distance. */
  near: ReadonlySet<string>;
}>;

export const NO_FOCUS: FocusTiles = { focusTile: null, disc: [], near: new Set() };

/** A tile with a wanted volume, and its channels in the bundle's order. */
export type WantedTile = Readonly<{
  tile: string;
  channels: readonly string[];
}>;

/** The tile that volumes follow: the selected one, or the gazed one. */
function focusTileOf(state: ViewerState, focusTiles: FocusTiles): string | null {
  return state.selected ?? focusTiles.focusTile;
}

/** Whether a channel is drawn as a volume wherever that is possible. */
function prefersVolume(channel: ChannelState): boolean {
  return !channel.hasSurface && channel.surfaceReason !== "";
}

/** How a channel is drawn in a tile, once all has arrived; null: not at all. */
export function representationOf(
  state: ViewerState,
  channel: ChannelState,
  tile: TileState,
  focusTiles: FocusTiles,
): Representation | null {
  if (!channel.shown || (state.isolated !== null && tile.id !== state.isolated)) return null;
  if (!channel.volume || state.mode === "off") return "mesh";
  if (tile.isUnfinished) return "volume"; // there is nothing else, and its volume is small
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

/** The one tile that is a volume among surfaces; null: there is none. */
export function marchedTile(state: ViewerState, focusTiles: FocusTiles): string | null {
  const tile = focusTileOf(state, focusTiles);
  return state.mode === "tile" && tile !== null && focusTiles.near.has(tile) ? tile : null;
}

/** Whether a channel's volumes show in the disc alone. */
export function isInDisc(state: ViewerState, channel: ChannelState): boolean {
  return state.mode === "disc" && !prefersVolume(channel) && !isUnfinished(state);
}

/** Whether volumes still stand for surfaces that are being built: then nothing else cuts into surfaces. */
function isUnfinished({ tiles }: ViewerState): boolean {
  return tiles.some((tile) => tile.isUnfinished);
}

/** The tiles that are marched, those in the disc first; where light is followed, until that has come. */
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

/** Whether a channel's surfaces, if it has any, are drawn anywhere: else they aren't loaded. */
export function wantsSurface(state: ViewerState, channel: ChannelState): boolean {
  if (!channel.shown) return false;
  if (channel.volume && isTraced(state)) return false;
  if (!channel.volume || !prefersVolume(channel) || state.mode === "off") return true;
  return state.mode === "stage" && state.tiles.some((tile) => tile.representation === "both");
}

/** How much of a tile's surface its volume takes away, 0..1; null: the surface is not drawn. */
export function takenFrom(
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
