/**
 * What the viewer shows, as plain data. Every change is a pure function; the GPU side reads the
 * state and follows it.
 */
import type { Manifest } from "../bundle/generated/bundle";
import type { Shapes } from "../bundle/transfer_2d";
import type { Clip } from "../math/clip";
import type { Rgb } from "../math/color";
import type { Vec3 } from "../math/vec3";
import {
  type Lamp,
  START_TRACE,
  type TraceSettings,
  withLamp,
  withTrace,
} from "./path_trace_settings";
import type { QualityLevel } from "./quality_controller";
import { type Functions, type Plane, withShapes } from "./transfer_functions_2d";

/**
 * So many channels show at once: one march samples as many from one texture. Of more, the one that
 * has been shown longest leaves.
 */
export const MAX_CHANNELS = 4;
/** So many tiles can open as volumes; of a larger specimen the chosen tile does. */
export const VOLUME_TILES_AT_START = 16;
/** Metres of the room: nearer than a headset's specimen is at the start. */
export const SWITCH_DISTANCE_M = 1.25;
export const DISC_RADIUS_DEG = 12;
const NO_FLOATS = "This device can't draw into textures of floats: light can't be gathered here.";
/** DICOM's terms for scans of whole bodies, which are best seen as light passes through them. */
const TRACED_MODALITIES: readonly string[] = ["MR", "CT"];

export type ChannelState = Functions &
  Readonly<{
    id: string;
    name: string;
    shown: boolean;
    /** When it was shown: the lowest leaves first. */
    turn: number;
    color: Rgb;
    original: Rgb;
    /** Factor to the opacity of its surface and of its volume, 0..1. */
    opacity: number;
    /** Part of the volume's intensities, 0..1, that the transfer function is stretched over. */
    window: readonly [number, number];
    /** Whether it may be drawn as a volume, where volumes are. */
    volume: boolean;
    hasSurface: boolean;
    /** Its surface can't be told from noise: as long as the volume is on, no surface is drawn. */
    prefersVolume: boolean;
  }>;

export type Representation = Manifest["tiles"][number]["representation"];

/** `representation`: what the stage draws there, as far as VOLUME_TILES_AT_START lets it. */
export type TileState = Readonly<{ id: string; representation: Representation }>;

/**
 * Where volumes are drawn. `disc`: round the gaze, across tiles. `tile`: in the gazed tile. `all`:
 * in all tiles. `stage`: as the stage has it; there are none of these unless an artist chose it.
 * `traced`: in all tiles, by paths of light. `off`: nowhere. The first two hold within the switch distance.
 */
export const MODES = ["disc", "tile", "all", "stage", "traced", "off"] as const;
export type Mode = (typeof MODES)[number];

export type ViewerState = Readonly<{
  channels: readonly ChannelState[];
  tiles: readonly TileState[];
  /** The tile nearest to the specimen's centre. */
  middle: string;
  mode: Mode;
  /** The tile that was chosen; null: the gaze chooses. */
  selected: string | null;
  /** The only tile that is shown; null: all are. */
  isolated: string | null;
  switchDistance_m: number;
  /** Angle between the gaze and the disc's rim. */
  discRadius_deg: number;
  /** What is left of the specimen, um. */
  clip: Clip;
  /** What a tap or a dwell on the specimen does. */
  tool: Tool;
  /** The measured points, um: none, one, or two. */
  measured: readonly Vec3[];
  /** Whether looking at something for long is as good as pressing the button. */
  isDwellOn: boolean;
  quality: QualityLevel;
  /** Whether this device can gather light: draw into textures of floats. */
  canTrace: boolean;
  /** How the picture of the mode `traced` is made. */
  trace: TraceSettings;
  /** Whether its lamps can be seen, and taken hold of. */
  areLampsShown: boolean;
  /** Faults that leave the rest usable, newest last. */
  notices: readonly string[];
  /** Of these, what another try may mend. */
  mendable: readonly string[];
}>;

/** `select`: the tile that is tapped; `measure`: from one tapped point to another. */
export type Tool = "select" | "measure";

export type Action =
  | Readonly<{ type: "show"; channel: string; shown: boolean }>
  | Readonly<{ type: "recolor"; channel: string; color: Rgb }>
  | Readonly<{ type: "fade"; channel: string; opacity: number }>
  | Readonly<{ type: "window"; channel: string; window: readonly [number, number] }>
  | Readonly<{ type: "draw-volume"; channel: string; volume: boolean }>
  | Readonly<{ type: "choose-transfer-function"; channel: string; name: string }>
  /** Other shapes for a transfer function, which is chosen by that; `own` may be a new one. */
  | Readonly<{ type: "set-shapes"; channel: string; name: string; shapes: Shapes }>
  /** What the bundle has of a channel's two-dimensional functions has come. */
  | Readonly<{ type: "learn-plane"; channel: string; plane: Plane }>
  | Readonly<{ type: "select"; tile: string | null }>
  | Readonly<{ type: "isolate"; tile: string | null }>
  | Readonly<{ type: "choose-mode"; mode: Mode }>
  | Readonly<{ type: "set-switch-distance"; distance_m: number }>
  | Readonly<{ type: "set-disc-radius"; radius_deg: number }>
  | Readonly<{ type: "set-clip"; clip: Clip }>
  | Readonly<{ type: "choose-tool"; tool: Tool }>
  | Readonly<{ type: "measure"; points: readonly Vec3[] }>
  | Readonly<{ type: "set-dwell"; isOn: boolean }>
  | Readonly<{ type: "choose-quality"; level: QualityLevel }>
  | Readonly<{ type: "trace"; change: Partial<Omit<TraceSettings, "lamps">> }>
  | Readonly<{ type: "move-lamp"; lamp: number; change: Partial<Lamp> }>
  | Readonly<{ type: "show-lamps"; areShown: boolean }>
  | Readonly<{ type: "notify"; text: string; isMendable?: boolean }>
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
 * The state in which a bundle opens: the first channels, as surfaces from afar and as volumes in
 * the disc when near; in the tiles that the stage draws as volumes, as those.
 */
export function initialState(manifest: Manifest, canTrace = true): ViewerState {
  const ordered = fromTheMiddle(manifest);
  const staged = ordered.filter((tile) => tile.representation !== "mesh");
  const asStaged = new Set(staged.slice(0, VOLUME_TILES_AT_START));
  const shown = new Set(manifest.channels.slice(0, MAX_CHANNELS).map(({ id }) => id));
  return {
    channels: manifest.channels.map((channel, index) => ({
      id: channel.id,
      name: channel.name,
      shown: shown.has(channel.id),
      turn: index - manifest.channels.length, // before all that is shown later
      color: channel.color,
      original: channel.color,
      opacity: 1,
      window: [0, 1],
      volume: true,
      transferFunction: channel.transfer_function,
      transferFunctions: channel.transfer_functions,
      transferFunctions2d: channel.transfer_functions_2d.names,
      plane: null,
      shapes: {},
      hasSurface: channel.tileset !== null,
      prefersVolume: channel.surface === "unclear",
    })),
    tiles: manifest.tiles.map((tile) => ({
      id: tile.id,
      representation: asStaged.has(tile) ? tile.representation : "mesh",
    })),
    middle: ordered[0].id,
    mode: startMode(manifest, canTrace, staged.length > 0),
    selected: null,
    isolated: null,
    switchDistance_m: SWITCH_DISTANCE_M,
    discRadius_deg: DISC_RADIUS_DEG,
    clip: { box: null, plane: null },
    tool: "select",
    measured: [],
    isDwellOn: true,
    quality: "auto",
    canTrace,
    trace: START_TRACE,
    areLampsShown: false,
    notices:
      staged.length > VOLUME_TILES_AT_START
        ? [
            `The stage draws ${staged.length} tiles as volumes: ` +
              `the ${VOLUME_TILES_AT_START} in the middle are, "All" draws the rest.`,
          ]
        : [],
    mendable: [],
  };
}

/** Scans of bodies open by paths of light; an artist's choice goes before the disc. */
function startMode({ specimen }: Manifest, canTrace: boolean, isStaged: boolean): Mode {
  if (TRACED_MODALITIES.includes(specimen.modality)) return canTrace ? "traced" : "all";
  return isStaged ? "stage" : "disc";
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

function withMendable(state: ViewerState, text: string, isMendable: boolean): ViewerState {
  const others = state.mendable.filter((n) => n !== text);
  return { ...state, mendable: isMendable ? [...others, text] : others };
}

/** Show a channel; if there is no room, the one that has been shown longest leaves: see announce_change.ts. */
function withShown(state: ViewerState, id: string): ViewerState {
  const channel = state.channels.find((c) => c.id === id);
  if (channel === undefined || channel.shown) return state;
  const turn = Math.max(0, ...state.channels.map((c) => c.turn + 1));
  const shown = state.channels.filter((c) => c.shown).sort((a, b) => a.turn - b.turn);
  const next = withChannel(state, id, (c) => ({ ...c, shown: true, turn }));
  const [leaves] = shown;
  if (shown.length < MAX_CHANNELS) return next;
  return withChannel(next, leaves.id, (c) => ({ ...c, shown: false }));
}

const clamp = (value: number, low: number, high: number) => Math.min(high, Math.max(low, value));

/** The limits of what a user can set. */
export const LIMITS = {
  switchDistance_m: [0.1, 10],
  discRadius_deg: [2, 40],
} as const;
/** Narrower, a window would be one step of the 8 bits. */
const NARROWEST_WINDOW = 1 / 128;

/** The next state. Returns the same object if the action changes nothing. */
export function reduce(state: ViewerState, action: Action): ViewerState {
  switch (action.type) {
    case "show":
      if (action.shown) return withShown(state, action.channel);
      return withChannel(state, action.channel, (c) => ({ ...c, shown: false }));
    case "recolor":
      return withChannel(state, action.channel, (c) => ({ ...c, color: action.color }));
    case "fade":
      return withChannel(state, action.channel, (c) => ({
        ...c,
        opacity: clamp(action.opacity, 0, 1),
      }));
    case "window": {
      const low = clamp(action.window[0], 0, 1 - NARROWEST_WINDOW);
      const high = clamp(action.window[1], low + NARROWEST_WINDOW, 1);
      return withChannel(state, action.channel, (c) => ({ ...c, window: [low, high] }));
    }
    case "draw-volume":
      return withChannel(state, action.channel, (c) => ({ ...c, volume: action.volume }));
    case "choose-transfer-function":
      return withChannel(state, action.channel, (c) =>
        c.transferFunctions.includes(action.name) ? { ...c, transferFunction: action.name } : c,
      );
    case "set-shapes":
      return withChannel(state, action.channel, (c) => withShapes(c, action.name, action.shapes));
    case "learn-plane":
      return withChannel(state, action.channel, (c) => ({ ...c, plane: action.plane }));
    case "select":
      return withTile(state, "selected", action.tile);
    case "isolate":
      // the isolated tile is the selected one: `back` leads from one to the other
      return withTile(
        action.tile === null ? state : withTile(state, "selected", action.tile),
        "isolated",
        action.tile,
      );
    case "choose-mode":
      if (action.mode === "traced" && !state.canTrace) return withNotice(state, NO_FLOATS);
      return action.mode === state.mode ? state : { ...state, mode: action.mode };
    case "set-switch-distance":
      return { ...state, switchDistance_m: clamp(action.distance_m, ...LIMITS.switchDistance_m) };
    case "set-disc-radius":
      return { ...state, discRadius_deg: clamp(action.radius_deg, ...LIMITS.discRadius_deg) };
    case "set-clip":
      return { ...state, clip: action.clip };
    case "choose-tool":
      return action.tool === state.tool ? state : { ...state, tool: action.tool };
    case "measure":
      return { ...state, measured: action.points.slice(-2) };
    case "set-dwell":
      return action.isOn === state.isDwellOn ? state : { ...state, isDwellOn: action.isOn };
    case "choose-quality":
      return action.level === state.quality ? state : { ...state, quality: action.level };
    case "trace":
      return { ...state, trace: withTrace(state.trace, action.change) };
    case "move-lamp":
      return { ...state, trace: withLamp(state.trace, action.lamp, action.change) };
    case "show-lamps":
      if (action.areShown === state.areLampsShown) return state;
      return { ...state, areLampsShown: action.areShown };
    case "notify":
      return withMendable(withNotice(state, action.text), action.text, action.isMendable === true);
    case "dismiss": {
      const notices = state.notices.filter((n) => n !== action.text);
      if (notices.length === state.notices.length) return state;
      return withMendable({ ...state, notices }, action.text, false);
    }
  }
}

function withTile(
  state: ViewerState,
  key: "selected" | "isolated",
  tile: string | null,
): ViewerState {
  const isThere = tile === null || state.tiles.some(({ id }) => id === tile);
  if (!isThere || state[key] === tile) return state;
  return { ...state, [key]: tile };
}

/** The notice that a change has brought, also if it was there before; null: none. */
export function newNotice(before: ViewerState, after: ViewerState): string | null {
  const isNew = after.notices !== before.notices && after.notices.length >= before.notices.length;
  return (isNew && after.notices.at(-1)) || null;
}

/** The channels that may be marched, in the bundle's order. */
export function volumeChannels(state: ViewerState): readonly ChannelState[] {
  return state.channels.filter((c) => c.shown && c.volume);
}

/** Whether volumes are drawn by paths of light. */
export function isTraced({ mode }: Pick<ViewerState, "mode">): boolean {
  return mode === "traced";
}
