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
}>;

export type VolumeScope = "one" | "all";

export type ViewerState = Readonly<{
  channels: readonly ChannelState[];
  tiles: readonly string[];
  /** Whether volumes are drawn in the chosen tile or in all tiles. */
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

/** The tile whose centre is nearest to the specimen's. */
function middleTile({ specimen, tiles }: Manifest): string {
  const centerOf = ({ min, max }: Manifest["specimen"]["bounds_um"]) =>
    min.map((v, i) => (v + max[i]) / 2);
  const center = centerOf(specimen.bounds_um);
  const distance = (tile: Manifest["tiles"][number]) =>
    Math.hypot(...centerOf(tile.bounds_um).map((v, i) => v - center[i]));
  return tiles.reduce((a, b) => (distance(b) < distance(a) ? b : a)).id;
}

/** The state in which a bundle opens: surfaces; volumes are off, ready in the middle tile. */
export function initialState(manifest: Manifest): ViewerState {
  const tiles = manifest.tiles.map((tile) => tile.id);
  return {
    channels: manifest.channels.map((channel, index) => ({
      id: channel.id,
      name: channel.name,
      shown: index < CHANNELS_AT_START,
      color: channel.color,
      original: channel.color,
      volume: false,
      transferFunction: channel.transfer_function,
      transferFunctions: channel.transfer_functions,
      hasSurface: channel.tileset !== null,
    })),
    tiles,
    scope: "one",
    tile: middleTile(manifest),
    notices: [],
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

/** The next state. Returns the same object if the action changes nothing. */
export function reduce(state: ViewerState, action: Action): ViewerState {
  switch (action.type) {
    case "show":
      return withChannel(state, action.channel, (c) => ({ ...c, shown: action.shown }));
    case "recolor":
      return withChannel(state, action.channel, (c) => ({ ...c, color: action.color }));
    case "draw-volume": {
      const drawn = state.channels.filter((c) => c.volume && c.id !== action.channel).length;
      if (action.volume && drawn >= MAX_VOLUME_CHANNELS) {
        return withNotice(
          state,
          `At most ${MAX_VOLUME_CHANNELS} channels can be volumes at once: turn one off first.`,
        );
      }
      return withChannel(state, action.channel, (c) => ({ ...c, volume: action.volume }));
    }
    case "choose-transfer-function":
      return withChannel(state, action.channel, (c) =>
        c.transferFunctions.includes(action.name) ? { ...c, transferFunction: action.name } : c,
      );
    case "choose-tile":
      if (action.tile === state.tile || !state.tiles.includes(action.tile)) return state;
      return { ...state, tile: action.tile };
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

/** The tiles in which volumes are drawn; none while no channel is a volume. */
export function volumeTiles(state: ViewerState): readonly string[] {
  if (volumeChannels(state).length === 0) return [];
  return state.scope === "all" ? state.tiles : [state.tile];
}

/** Whether a tile's surface is drawn. It stays until the volume that replaces it has arrived. */
export function isSurfaceShown(
  state: ViewerState,
  channel: string,
  tile: string,
  hasVolume: boolean,
): boolean {
  const found = state.channels.find((c) => c.id === channel);
  if (found === undefined || !found.shown) return false;
  return !(found.volume && hasVolume && volumeTiles(state).includes(tile));
}
