/**
 * The interface between the host and the parts that draw the specimen: as surfaces, volumes, or by
 * path tracing.
 */
import type { Camera } from "three";
import type { Vec3 } from "../math/vec3";
import type { BlendedScene } from "../render/blend_material";
import type { MarchedVolumes, TracedVolumes } from "../render/drawn_forms";
import type { FocusState } from "../state/focus_tiles";
import type { Progress } from "../state/overview_progress";
import type { ChannelState, ViewerState } from "../state/viewer_state";

/** Largest error of surfaces on screen, in pixels, if frames are in time. */
export const ERROR_TARGET_PX = 2;

/** The tiles that the gaze shows as volumes, and the volumes that may be loaded. */
export type Focus = Readonly<{
  focusTiles: FocusState;
  /** Whether the gaze has rested, so that finer resolution levels of the volumes may be fetched. */
  mayRefine: boolean;
  /** Whether the overview of all tiles is loaded. Volumes are loaded after it. */
  hasOverview: boolean;
}>;

/** Camera, image size and allowed error for which a form fetches its files. */
export type StreamView = Readonly<{
  camera: Camera;
  width_px: number;
  height_px: number;
  /** Largest distance on screen between a drawn surface and the exact one, in pixels. */
  error_px: number;
}>;

/**
 * A way to draw the specimen. A part offers it as its member `form`.
 *
 * ```ts
 * import type { Form, StreamView } from "./form";
 *
 * // Draws nothing, and remembers for which error surfaces would be fetched.
 * class ErrorProbe implements Form {
 *   readonly triangles = 0;
 *   error_px = Number.POSITIVE_INFINITY;
 *
 *   stream({ error_px }: StreamView): void {
 *     this.error_px = Math.min(this.error_px, error_px);
 *   }
 * }
 * ```
 */
export interface Form {
  /** Loading progress of the overview of all tiles. */
  readonly overview?: Progress;
  /** Whether all tiles of the first shown channel are on screen. */
  readonly hasFirst?: boolean;
  /** Whether some data of the frame is not drawn at all, not even at a coarse resolution. */
  readonly isIncomplete?: boolean;
  /** Number of triangles that this form has on screen. */
  readonly triangles?: number;
  /** Surfaces that are translucent now. */
  readonly panes?: readonly BlendedScene[];
  readonly marched?: MarchedVolumes;
  readonly traced?: TracedVolumes;
  /**
   * Returns the outermost points (um, world) of the visible part of a channel. null: not known yet;
   * undefined: this form does not draw the channel now.
   */
  outline?(state: ViewerState, channel: ChannelState): readonly Vec3[] | null | undefined;
  /** Limits volumes to a number of voxels along a tile's edge, from the next `sync` on. */
  limitEdge?(edge: number): void;
  /** Drops the textures after the graphics context was lost. */
  forget?(): void;
  /** Advances fades by a time. Returns whether anything still fades. */
  fade?(fade_s: number): boolean;
  /** Fetches the files that the view needs, and drops those that it does not need. */
  stream?(view: StreamView): void;
  /** Called before each frame, after the volumes have faded. */
  updateMaterials?(): void;
}
