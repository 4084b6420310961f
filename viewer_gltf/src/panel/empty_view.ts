/** Why nothing is visible, and how to change that: one sentence and one button. Pure. */
import { around } from "../math/box";
import { type Clip, isCutAway, WHOLE } from "../math/clip";
import { type BoxedTile, shownTiles } from "../math/pick";
import { dot, type Vec3 } from "../math/vec3";
import type { Action } from "../state/actions";
import { type ObjectView, START_OBJECTS } from "../state/objects";
import { OPACITY, VOLUME } from "../state/parameters/channel";
import { setTo } from "../state/parameters/kinds";
import { MODE } from "../state/parameters/volumes";
import { tileName } from "../state/tile_name";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import type { Offer } from "./controls";

export type EmptyView = Readonly<{ text: string; offer: Offer }>;

/** Facts about the content that are not in the state. */
export type Content = Readonly<{
  tiles: readonly BoxedTile[];
  /** The state in which the bundle opened. */
  opening: ViewerState;
  /** Outermost points of a channel as it is shown now, um; null: not known. */
  outline: (channel: ChannelState) => readonly Vec3[] | null;
  hasSurface: (channel: string, tile: string) => boolean;
  /** Returns whether a channel has a volume in a tile; null: not known yet. */
  hasVolume: (channel: string, tile: string) => boolean | null;
  /** Number of objects of a label map that are shown; null: not known yet. */
  shownObjectCount: (channel: string) => number | null;
}>;

/** Returns null if something is visible, or if that is not known yet. */
export function emptyViewOf(state: ViewerState, content: Content): EmptyView | null {
  const shown = state.channels.filter((channel) => channel.shown);
  return (
    allHidden(shown, content) ??
    transparent(shown) ??
    cutAway(state, shown, content) ??
    noForm(state, shown, content) ??
    emptyTile(state, shown, content) ??
    noObjects(state, shown, content)
  );
}

function offerOf(label: string, ...to: readonly Action[]): Offer {
  return { label, to };
}

function allHidden(shown: readonly ChannelState[], { opening }: Content): EmptyView | null {
  if (shown.length > 0) return null;
  const opened = opening.channels.filter((channel) => channel.shown);
  const label = opened.length === 1 ? `Show ${opened[0].name}` : "Show the channels again";
  const show = opened.map(({ id }): Action => ({ type: "show", channel: id, shown: true }));
  return { text: "All channels are hidden.", offer: offerOf(label, ...show) };
}

function transparent(shown: readonly ChannelState[]): EmptyView | null {
  if (shown.some(({ opacity }) => opacity > 0)) return null;
  const opaque = shown.map(({ id }) => setTo(OPACITY, 1, id));
  const text = "All channels that are shown have an opacity of 0 %.";
  return { text, offer: offerOf("Set them to 100 %", ...opaque) };
}

function cutAway(
  { clip, isolated, tiles: all }: ViewerState,
  shown: readonly ChannelState[],
  { tiles, outline }: Content,
): EmptyView | null {
  if (clip.box === null && clip.plane === null) return null;
  const left = shownTiles(tiles, isolated);
  const { min, max } = around(tiles.flatMap(({ bounds_um }) => [bounds_um.min, bounds_um.max]));
  const cut = relaxed(clip, SLICE_SHARE * Math.max(...max.map((v, i) => v - min[i])));
  const isGone = left.every(({ bounds_um }) => isCutAway(bounds_um, cut));
  const hasNothing = (channel: ChannelState) => {
    const points = outline(channel);
    return points !== null && isOutside(points, cut);
  };
  // An outline covers all tiles, so it does not show whether a single tile is empty.
  if (!isGone && !(isolated === null && shown.every(hasNothing))) return null;
  const what = isolated === null ? "the specimen" : tileName(isolated, all);
  const remove: Action = { type: "set-clip", clip: WHOLE };
  return { text: `The cut removes all of ${what}.`, offer: offerOf("Remove the cut", remove) };
}

/** Share of the specimen's longest edge. A plane that leaves a thinner slice still shows its cut face. */
const SLICE_SHARE = 0.01;

/** Returns the cut with its plane moved back by a distance. */
function relaxed(clip: Clip, by_um: number): Clip {
  const { plane } = clip;
  return plane === null
    ? clip
    : { ...clip, plane: { ...plane, offset_um: plane.offset_um + by_um } };
}

/** Returns whether the cut removes the whole hull of some points. */
function isOutside(points: readonly Vec3[], clip: Clip): boolean {
  const { plane } = clip;
  const isBeyond =
    plane !== null && points.every((point) => dot(plane.normal, point) >= plane.offset_um);
  return isBeyond || (points.length > 0 && isCutAway(around(points), { ...clip, plane: null }));
}

/** Detects channels without surfaces whose volumes are switched off. */
function noForm(
  state: ViewerState,
  shown: readonly ChannelState[],
  { opening }: Content,
): EmptyView | null {
  const isOff = (channel: ChannelState) => state.mode === "off" || !channel.volume;
  if (!shown.every((channel) => !channel.hasSurface && isOff(channel))) return null;
  const mode = opening.mode === "off" ? "all" : opening.mode;
  const volumes = shown.filter(({ volume }) => !volume).map(({ id }) => setTo(VOLUME, true, id));
  return {
    text: "The shown channels have no surface, and their volumes are switched off.",
    offer: offerOf(
      "Show the volumes",
      ...volumes,
      ...(state.mode === "off" ? [setTo(MODE, mode)] : []),
    ),
  };
}

/** Detects that the isolated tile, or the tile that is drawn as a volume, is empty. */
function emptyTile(
  state: ViewerState,
  shown: readonly ChannelState[],
  { hasSurface, hasVolume }: Content,
): EmptyView | null {
  const { isolated, selected, mode } = state;
  const tile = isolated ?? (mode === "tile" ? selected : null);
  if (tile === null || shown.some(({ id }) => hasSurface(id, tile))) return null;
  const volumes = shown.map((channel) => channel.volume && hasVolume(channel.id, tile));
  if (volumes.includes(null)) return null;
  const name = tileName(tile, state.tiles);
  if (volumes.includes(true)) {
    if (mode === "all" || mode === "traced" || isolated === null) return null;
    const remedy =
      mode === "disc" || mode === "tile"
        ? "Move closer to see its volumes."
        : "Its volumes are not drawn in this mode.";
    return {
      text: `The shown channels have no surface in ${name}. ${remedy}`,
      offer: offerOf("Show volumes everywhere", setTo(MODE, "all")),
    };
  }
  return {
    text: `The shown channels have neither a surface nor a volume in ${name}.`,
    offer:
      isolated === null
        ? offerOf("Clear the selection", { type: "select", tile: null })
        : offerOf("Show all tiles", { type: "isolate", tile: null }),
  };
}

const ALL_OBJECTS: Partial<ObjectView> = { hidden: [], only: null, ranges: {}, without: {} };

function noObjects(
  { objects }: ViewerState,
  shown: readonly ChannelState[],
  { shownObjectCount }: Content,
): EmptyView | null {
  if (!shown.every(({ id, hasObjects }) => hasObjects && shownObjectCount(id) === 0)) return null;
  const all = shown
    .filter(({ id }) => (objects[id] ?? START_OBJECTS) !== START_OBJECTS)
    .map(({ id }): Action => ({ type: "objects", channel: id, change: ALL_OBJECTS }));
  return {
    text: "All objects are hidden, or removed by filters.",
    offer: offerOf("Show all objects", ...all),
  };
}
