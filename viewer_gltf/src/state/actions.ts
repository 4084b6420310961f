/** The actions that change the state. */

import type { Shapes, Transfer2d } from "../bundle/transfer_2d";
import type { Clip } from "../math/clip";
import type { Vec3 } from "../math/vec3";
import type { KeptView } from "./kept_views";
import type { Measurement } from "./measurements";
import type { ObjectChange } from "./objects";
import type { SetAction } from "./parameters/kinds";
import type { ViewerState } from "./viewer_state";

/**
 * Actions of the parts, by type. A part adds its actions by `declare module`; its definition has
 * their rules.
 */
// biome-ignore lint/suspicious/noEmptyInterface: parts can extend an interface, but not a type
export interface PartActions {}
export type PartAction = PartActions[keyof PartActions];

export type Action =
  | PartAction
  | ObjectChange
  /** The user sets a number, a switch, a choice or a colour (see parameters/). */
  | SetAction
  | Readonly<{ type: "show"; channel: string; shown: boolean }>
  | Readonly<{ type: "window"; channel: string; window: readonly [number, number] }>
  | Readonly<{ type: "choose-transfer-function"; channel: string; name: string }>
  /**
   * Replaces the shapes of a transfer function and makes that function the chosen one. If the name
   * is `own`, the function may not exist yet.
   */
  | Readonly<{ type: "set-shapes"; channel: string; name: string; shapes: Shapes }>
  /** The bundle's two-dimensional transfer functions of a channel have been fetched. */
  | Readonly<{ type: "learn-transfer-2d"; channel: string; transfer2d: Transfer2d }>
  | Readonly<{ type: "select"; tile: string | null }>
  | Readonly<{ type: "isolate"; tile: string | null }>
  | Readonly<{ type: "set-clip"; clip: Clip }>
  /** Replaces the points of the measurement in progress, in um; its kind is the chosen one. */
  | Readonly<{ type: "measure"; points: readonly Vec3[] }>
  /** Adds a point to the measurement in progress, or begins another measurement with it. um. */
  | Readonly<{ type: "add-point"; point: Vec3 }>
  /** Moves the measurement in progress to the list of finished ones. */
  | Readonly<{ type: "finish-measuring" }>
  /** Replaces the list of finished measurements: after a rename, a deletion, or loading a link. */
  | Readonly<{ type: "set-measurements"; measurements: readonly Measurement[] }>
  /** Moves a lamp to a place, in lengths of the specimen's longest edge from its middle. */
  | Readonly<{ type: "move-lamp"; lamp: number; place: Vec3 }>
  /**
   * Returns to an earlier state. Values that are not the user's stay as they are (see history.ts).
   */
  | Readonly<{ type: "restore"; state: ViewerState }>
  /** Replaces the views that a video goes through. */
  | Readonly<{ type: "keep-views"; views: readonly KeptView[] }>
  | Readonly<{ type: "notify"; text: string; isRetryable?: boolean }>
  | Readonly<{ type: "dismiss"; texts: readonly string[] }>;
