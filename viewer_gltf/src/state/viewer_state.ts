/**
 * What the viewer shows, as plain data. Every change is a pure function; the GPU side reads the
 * state and follows it. What a user sets by a number, a switch or a choice is in parameters/.
 */
import type { Manifest } from "../bundle/generated/bundle";
import type { Clip } from "../math/clip";
import type { Rgb } from "../math/color";
import type { KeptView } from "./kept_views";
import type { Measuring } from "./measurements";
import type { ObjectViews } from "./objects";
import type { ChannelSettings } from "./parameters/channel";
import type { Settings } from "./parameters/settings";
import type { Functions } from "./transfer_functions_2d";

/**
 * So many channels show at once: one march samples as many from one texture. Of more, the one that
 * has been shown longest leaves.
 */
export const MAX_CHANNELS = 4;

export type ChannelState = Functions &
  ChannelSettings &
  Readonly<{
    id: string;
    name: string;
    shown: boolean;
    /** When it was shown: the lowest leaves first. */
    turn: number;
    /** The bundle's colour. */
    original: Rgb;
    /** Part of the volume's intensities, 0..1, that the transfer function is stretched over. */
    window: readonly [number, number];
    hasSurface: boolean;
    /** A label map: closed objects, and no volume. */
    hasObjects: boolean;
    /** Why the build made no surface: its volume is drawn from afar too. Empty: it made one. */
    surfaceReason: string;
  }>;

export type Representation = Manifest["tiles"][number]["representation"];

/** `representation`: what the stage draws there, as far as VOLUME_TILES_AT_START lets it. */
export type TileState = Readonly<{
  id: string;
  /** The name that the stage gives the tile; absent: it has none. */
  name?: string;
  representation: Representation;
  /** Its surfaces are not built yet; absent: they are. */
  isUnfinished?: true;
}>;

export type ViewerState = Settings &
  Measuring &
  Readonly<{
    channels: readonly ChannelState[];
    tiles: readonly TileState[];
    /** Of the channels that are label maps. */
    objects: ObjectViews;
    /** The tile nearest to the specimen's centre. */
    middle: string;
    /** The tile that was chosen; null: the gaze chooses. */
    selected: string | null;
    /** The only tile that is shown; null: all are. */
    isolated: string | null;
    /** The part of the specimen that the cuts leave, um. */
    clip: Clip;
    /** Views that a video goes through. */
    keptViews: readonly KeptView[];
    /** Whether this device can gather light: draw into textures of floats. */
    canTrace: boolean;
    /** Faults that leave the rest usable, newest last. */
    notices: readonly string[];
    /** Of these, what another try may mend. */
    mendable: readonly string[];
  }>;

/** The channels that may be marched, in the bundle's order. */
export function volumeChannels(state: ViewerState): readonly ChannelState[] {
  return state.channels.filter((c) => c.shown && c.volume);
}

/** Whether there is a volume at all: label maps have none. */
export const hasVolumes = ({ channels }: Pick<ViewerState, "channels">): boolean =>
  channels.some(({ hasObjects }) => !hasObjects);

/** Whether a channel is shown that has one. */
export const showsVolumes = ({ channels }: Pick<ViewerState, "channels">): boolean =>
  channels.some(({ shown, hasObjects }) => shown && !hasObjects);
