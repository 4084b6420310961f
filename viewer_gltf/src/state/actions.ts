/** All that can be asked of the state. */

import type { Shapes, Transfer2d } from "../bundle/transfer_2d";
import type { Clip } from "../math/clip";
import type { Vec3 } from "../math/vec3";
import type { KeptView } from "./kept_views";
import type { Measurement } from "./measurements";
import type { ObjectChange } from "./objects";
import type { SetAction } from "./parameters/kinds";
import type { ViewerState } from "./viewer_state";

/** Actions of parts, by their types. A part adds its own by `declare module`, and their rules in its definition. */
// biome-ignore lint/suspicious/noEmptyInterface: a type could not be extended by parts
export interface PartActions {}
export type PartAction = PartActions[keyof PartActions];

export type Action =
  | PartAction
  | ObjectChange
  /** The user sets a number, a switch, a choice or a colour: see parameters/. */
  | SetAction
  | Readonly<{ type: "show"; channel: string; shown: boolean }>
  | Readonly<{ type: "window"; channel: string; window: readonly [number, number] }>
  | Readonly<{ type: "choose-transfer-function"; channel: string; name: string }>
  /** Other shapes for a transfer function, which is chosen by that; `own` may be a new one. */
  | Readonly<{ type: "set-shapes"; channel: string; name: string; shapes: Shapes }>
  /** The bundle's two-dimensional functions of a channel have come. */
  | Readonly<{ type: "learn-transfer-2d"; channel: string; transfer2d: Transfer2d }>
  | Readonly<{ type: "select"; tile: string | null }>
  | Readonly<{ type: "isolate"; tile: string | null }>
  | Readonly<{ type: "set-clip"; clip: Clip }>
  /** The points of the newest measurement, of the kind that is chosen. */
  | Readonly<{ type: "measure"; points: readonly Vec3[] }>
  /** One more, or the first of another. */
  | Readonly<{ type: "add-point"; point: Vec3 }>
  /** The newest measurement is done. */
  | Readonly<{ type: "finish-measuring" }>
  /** Those that are done: named otherwise, fewer, or another's. */
  | Readonly<{ type: "set-measurements"; measurements: readonly Measurement[] }>
  /** Where a lamp is dragged to. */
  | Readonly<{ type: "move-lamp"; lamp: number; place: Vec3 }>
  /** Back to a state of before, but for what is no user's: see history.ts. */
  | Readonly<{ type: "restore"; state: ViewerState }>
  /** The views to go through. */
  | Readonly<{ type: "keep-views"; views: readonly KeptView[] }>
  | Readonly<{ type: "notify"; text: string; isMendable?: boolean }>
  | Readonly<{ type: "dismiss"; texts: readonly string[] }>;
