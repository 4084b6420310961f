/**
 * What the viewer shows, as plain data. Every change is a pure function; the GPU side reads the
 * state and follows it.
 */
import type { Manifest } from "./bundle/generated/bundle";
import type { Rgb } from "./color";

/** A bundle may hold 70 channels; the first few are on at the start. */
export const CHANNELS_AT_START = 6;
/** One march samples so many channels at once: each costs a texture unit and a lookup a step. */
export const MAX_VOLUME_CHANNELS = 4;
/** So many tiles can open as volumes; of a larger specimen the chosen tile does. */
export const VOLUME_TILES_AT_START = 16;

export type ChannelState = Readonly<{
  id: string;
  name: string;
  shown: boolean;
  color: Rgb;
  original: Rgb;
  volume: boolean;
  transferFunction: string;
  transferFunctions: readonly string[];
  hasSurface: boolean;
  /** Its surface can't be told from noise: as long as the volume is on, no surface is drawn. */
  prefersVolume: boolean;
}>;

export type Representation = Manifest["tiles"][number]["representation"];

/** `representation`: what the stage draws there, as far as VOLUME_TILES_AT_START lets it. */
export type TileState = Readonly<{ id: string; representation: Representation }>;

/** `stage`: where the stage draws volumes; there are none of these unless an artist chose it. */
export type VolumeScope = "one" | "all" | "stage";

export type ViewerState = Readonly<{
  channels: readonly ChannelState[];
  tiles: readonly TileState[];
  /** Whether volumes are drawn in the chosen tile, in all tiles, or as the stage has it. */
  scope: VolumeScope;
  tile: string;
  /** Faults that leave the rest usable, newest last. */
  notices: readonly string[];
}>;

export type Action =
  | Readonly<{ type: "show"; channel: string; shown: boolean }>
  | Readonly<{ type: "recolor"; channel: string; color: Rgb }>
  | Readonly<{ type: "draw-volume"; channel: string; volume: boolean }>
  | Readonly<{ type: "choose-transfer-function"; channel: string; name: string }>
  | Readonly<{ type: "choose-tile"; tile: string }>
  | Readonly<{ type: "choose-scope"; scope: VolumeScope }>
  | Readonly<{ type: "notify"; text: string }>
  | Readonly<{ type: "dismiss"; text: string }>;

/** The tiles, those first whose centres are nearest to the specimen's. */
function fromTheMiddle({ specimen, tiles }: Manifest): Manifest["tiles"][number][] {
  const centerOf = ({ min, max }: Manifest["specimen"]["bounds_um"]) =>
    min.map((v, i) => (v + max[i]) / 2);
  const center = centerOf(specimen.bounds_um);
  const distance = (tile: Manifest["tiles"][number]) =>
    Math.hypot(...centerOf(tile.bounds_um).map((v, i) => v - center[i]));
  return [...tiles].sort((a, b) => distance(a) - distance(b));
}

/**
 * The state in which a bundle opens: surfaces, but volumes of the channels without a clear one, and
 * of all shown channels in the tiles that the stage draws as volumes. Channels that would find no
 * room there as volumes are off. The other volumes are off, ready in the middle tile.
 */
export function initialState(manifest: Manifest): ViewerState {
  const ordered = fromTheMiddle(manifest);
  const staged = ordered.filter((tile) => tile.representation !== "mesh");
  const asStaged = new Set(staged.slice(0, VOLUME_TILES_AT_START));
  const tiles = manifest.tiles.map((tile) => ({
    id: tile.id,
    representation: asStaged.has(tile) ? tile.representation : "mesh",
  }));
  const lacksSurface = tiles.some((tile) => tile.representation === "volume");
  const first = manifest.channels.slice(0, CHANNELS_AT_START);
  const unclear = first.filter((channel) => channel.surface === "unclear");
  const wanted = new Set(staged.length > 0 ? [...unclear, ...first] : unclear);
  const asVolumes = new Set([...wanted].slice(0, MAX_VOLUME_CHANNELS).map(({ id }) => id));
  const isSmall = tiles.length <= VOLUME_TILES_AT_START;
  return {
    channels: manifest.channels.map((channel, index) => {
      const prefersVolume = channel.surface === "unclear";
      const volume = asVolumes.has(channel.id);
      return {
        id: channel.id,
        name: channel.name,
        shown: index < CHANNELS_AT_START && (volume || !(prefersVolume || lacksSurface)),
        color: channel.color,
        original: channel.color,
        volume,
        transferFunction: channel.transfer_function,
        transferFunctions: channel.transfer_functions,
        hasSurface: channel.tileset !== null,
        prefersVolume,
      };
    }),
    tiles,
    scope: staged.length > 0 ? "stage" : asVolumes.size > 0 && isSmall ? "all" : "one",
    tile: ordered[0].id,
    notices:
      staged.length > VOLUME_TILES_AT_START
        ? [
            `The stage draws ${staged.length} tiles as volumes: ` +
              `the ${VOLUME_TILES_AT_START} in the middle are, "All tiles" draws the rest.`,
          ]
        : [],
  };
}

function withChannel(
  state: ViewerState,
  id: string,
  change: (channel: ChannelState) => ChannelState,
): ViewerState {
  return { ...state, channels: state.channels.map((c) => (c.id === id ? change(c) : c)) };
}

function withNotice(state: ViewerState, text: string): ViewerState {
  return { ...state, notices: [...state.notices.filter((n) => n !== text), text] };
}

function otherVolumes(state: ViewerState, id: string): number {
  return state.channels.filter((c) => c.volume && c.id !== id).length;
}

/** The next state. Returns the same object if the action changes nothing. */
export function reduce(state: ViewerState, action: Action): ViewerState {
  switch (action.type) {
    case "show": {
      const hasRoom = otherVolumes(state, action.channel) < MAX_VOLUME_CHANNELS;
      return withChannel(state, action.channel, (c) => ({
        ...c,
        shown: action.shown,
        volume:
          c.volume || (action.shown && hasRoom && (c.prefersVolume || state.scope === "stage")),
      }));
    }
    case "recolor":
      return withChannel(state, action.channel, (c) => ({ ...c, color: action.color }));
    case "draw-volume":
      if (action.volume && otherVolumes(state, action.channel) >= MAX_VOLUME_CHANNELS) {
        return withNotice(
          state,
          `At most ${MAX_VOLUME_CHANNELS} channels can be volumes at once: turn one off first.`,
        );
      }
      return withChannel(state, action.channel, (c) => ({ ...c, volume: action.volume }));
    case "choose-transfer-function":
      return withChannel(state, action.channel, (c) =>
        c.transferFunctions.includes(action.name) ? { ...c, transferFunction: action.name } : c,
      );
    case "choose-tile":
      if (!state.tiles.some(({ id }) => id === action.tile)) return state;
      if (action.tile === state.tile && state.scope !== "stage") return state;
      return { ...state, tile: action.tile, scope: state.scope === "stage" ? "one" : state.scope };
    case "choose-scope":
      return action.scope === state.scope ? state : { ...state, scope: action.scope };
    case "notify":
      return withNotice(state, action.text);
    case "dismiss":
      return { ...state, notices: state.notices.filter((n) => n !== action.text) };
  }
}

/** The channels that are marched, in the bundle's order. */
export function volumeChannels(state: ViewerState): readonly ChannelState[] {
  return state.channels.filter((c) => c.shown && c.volume);
}

/** How a channel is drawn in a tile, once all has arrived; null: not at all. */
function drawnAs(
  state: ViewerState,
  { shown, volume, prefersVolume }: ChannelState,
  { id, representation }: TileState,
): Representation | null {
  if (!shown) return null;
  if (!volume) return "mesh";
  const isChosen = state.scope === "all" || id === state.tile;
  const otherwise = prefersVolume ? null : "mesh";
  if (state.scope !== "stage") return isChosen ? "volume" : otherwise;
  if (representation !== "mesh") return representation;
  const isSmall = state.tiles.length <= VOLUME_TILES_AT_START;
  return prefersVolume && (isSmall || isChosen) ? "volume" : otherwise;
}

/** The tiles in which a channel's volumes are drawn. */
export function volumeTiles(state: ViewerState, channel: ChannelState): readonly string[] {
  const drawn = state.tiles.filter((tile) => {
    const as = drawnAs(state, channel, tile);
    return as === "volume" || as === "both";
  });
  return drawn.map(({ id }) => id);
}

/** Whether a channel's surfaces, if it has any, are drawn anywhere: else they aren't loaded. */
export function wantsSurface(state: ViewerState, channel: ChannelState): boolean {
  if (!channel.shown) return false;
  if (!channel.volume || !channel.prefersVolume) return true;
  return state.tiles.some((tile) => drawnAs(state, channel, tile) === "both");
}

/** Whether a tile's surface is drawn. It stays until the volume that replaces it has arrived. */
export function isSurfaceShown(
  state: ViewerState,
  channel: string,
  tile: string,
  hasVolume: boolean,
): boolean {
  const found = state.channels.find((c) => c.id === channel);
  const place = state.tiles.find((t) => t.id === tile);
  if (found === undefined || place === undefined) return false;
  const as = drawnAs(state, found, place);
  return as === "mesh" || as === "both" || (as === "volume" && !found.prefersVolume && !hasVolume);
}
