/**
 * What the viewer shows, as plain data. Every change is a pure function; the GPU side reads the
 * state and follows it.
 */
import type { Manifest } from "../bundle/generated/bundle";
import type { Clip } from "../math/clip";
import type { Rgb } from "../math/color";
import type { Vec3 } from "../math/vec3";
import type { TraceSettings } from "./path_trace_settings";
import type { QualityLevel } from "./quality_controller";
import type { Functions } from "./transfer_functions_2d";

/**
 * So many channels show at once: one march samples as many from one texture. Of more, the one that
 * has been shown longest leaves.
 */
export const MAX_CHANNELS = 4;

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

/** The channels that may be marched, in the bundle's order. */
export function volumeChannels(state: ViewerState): readonly ChannelState[] {
  return state.channels.filter((c) => c.shown && c.volume);
}

/** Whether volumes are drawn by paths of light. */
export function isTraced({ mode }: Pick<ViewerState, "mode">): boolean {
  return mode === "traced";
}
