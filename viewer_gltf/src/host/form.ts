/** The interface between the host and the parts that draw the specimen: by surfaces, volumes, or paths of light. */
import type { Camera } from "three";
import type { Vec3 } from "../math/vec3";
import type { BlendedScene } from "../render/blend_material";
import type { MarchedVolumes, TracedVolumes } from "../render/drawn_forms";
import type { FocusState } from "../state/focus_tiles";
import type { Progress } from "../state/overview_progress";
import type { ChannelState, ViewerState } from "../state/viewer_state";

/** Screen-space error, in pixels, down to which surfaces are refined where frames come in time. */
export const ERROR_TARGET_PX = 2;

/** Which tiles the gaze makes volumes of, and which volumes may come. */
export type Focus = Readonly<{
  focusTiles: FocusState;
  /** Whether the gaze has rested, so that finer levels may be fetched. */
  mayRefine: boolean;
  /** Whether all tiles have their first picture: volumes come after it. */
  hasOverview: boolean;
}>;

/** The values that a form is given for each eye. */
export type StreamView = Readonly<{
  camera: Camera;
  width_px: number;
  height_px: number;
  /** Largest error on screen. */
  error_px: number;
}>;

/** A way to draw the specimen. */
export interface Form {
  /** How far the first picture of all tiles has come. */
  readonly overview?: Progress;
  /** Whether all tiles show, in the first channel. */
  readonly hasFirst?: boolean;
  /** Whether a piece of the frame is missing, not merely coarse. */
  readonly isIncomplete?: boolean;
  /** Triangles on screen. */
  readonly triangles?: number;
  /** Surfaces that are not opaque now. */
  readonly panes?: readonly BlendedScene[];
  readonly marched?: MarchedVolumes;
  readonly traced?: TracedVolumes;
  /**
   * Outermost points (um, world) of what shows of a channel. null: not known yet; undefined: the channel is not drawn
   * in this way now.
   */
  outline?(state: ViewerState, channel: ChannelState): readonly Vec3[] | null | undefined;
  /** Draws volumes of at most so many voxels along a tile's edge, from the next `sync` on. */
  limitEdge?(edge: number): void;
  /** The graphics context is gone, and the texels with it. */
  forget?(): void;
  /** Goes on with what fades, by so long. Returns whether anything still fades. */
  fade?(fade_s: number): boolean;
  /** Fetches what the eye needs, and drops what it does not. */
  stream?(view: StreamView): void;
  /** Called before each frame, when the volumes have faded as far as it shows. */
  dress?(): void;
}
