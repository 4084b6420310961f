/**
 * The state of the viewer, as plain data. Every change is a pure function; the GPU side reads the
 * state and follows it. Settings that a user makes by a number, a switch or a choice are in
 * parameters/.
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
 * Largest number of channels that can be shown: one march samples four channels from one texture.
 * Another one hides the channel that has been shown longest.
 */
export const MAX_CHANNELS = 4;

export type ChannelState = Functions &
  ChannelSettings &
  Readonly<{
    id: string;
    name: string;
    shown: boolean;
    /** Order in which channels were shown; the lowest one is hidden first. */
    turn: number;
    /** Colour in the bundle. */
    original: Rgb;
    /**
     * Lowest and highest intensity (0..1) of the range over which the transfer function is
     * stretched.
     */
    window: readonly [number, number];
    hasSurface: boolean;
    /** Whether the channel is a label map: objects with closed surfaces, and no volume. */
    hasObjects: boolean;
    /**
     * Reason why the build made no surface, in which case the volume is drawn from afar too; "": it
     * made one.
     */
    surfaceReason: string;
  }>;

export type Representation = Manifest["tiles"][number]["representation"];

/** `representation`: how the stage draws the tile, for at most VOLUME_TILES_AT_START tiles. */
export type TileState = Readonly<{
  id: string;
  /** Name that the stage gives the tile; absent: none. */
  name?: string;
  representation: Representation;
  /** true: the surfaces of the tile are not built yet. */
  isUnfinished?: true;
}>;

export type ViewerState = Settings &
  Measuring &
  Readonly<{
    channels: readonly ChannelState[];
    tiles: readonly TileState[];
    /** How the objects of each label map are shown, by channel. */
    objects: ObjectViews;
    /** Tile nearest to the specimen's centre. */
    middle: string;
    /** Tile that the user has selected; null: none, so that volumes follow the gaze. */
    selected: string | null;
    /** The only tile that is shown; null: all tiles are. */
    isolated: string | null;
    /** Clip box and clip plane, um, which cut away parts of the specimen. */
    clip: Clip;
    /** Views that a video goes through. */
    keptViews: readonly KeptView[];
    /** Whether this device can trace paths, for which it must draw into floating-point textures. */
    canTrace: boolean;
    /** Messages about faults despite which the viewer stays usable, newest last. */
    notices: readonly string[];
    /** Notices of faults that another attempt may solve. */
    retryable: readonly string[];
  }>;

/** Returns the channels that may be drawn as volumes, in the order of the bundle. */
export function volumeChannels(state: ViewerState): readonly ChannelState[] {
  return state.channels.filter((c) => c.shown && c.volume);
}

/** Returns whether the bundle has a volume. Label maps have none. */
export const hasVolumes = ({ channels }: Pick<ViewerState, "channels">): boolean =>
  channels.some(({ hasObjects }) => !hasObjects);

/** Returns whether a shown channel has a volume. */
export const showsVolumes = ({ channels }: Pick<ViewerState, "channels">): boolean =>
  channels.some(({ shown, hasObjects }) => shown && !hasObjects);
