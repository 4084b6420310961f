/** All that can be asked of the state. */

import type { Shapes } from "../bundle/transfer_2d";
import type { Clip } from "../math/clip";
import type { Rgb } from "../math/color";
import type { Vec3 } from "../math/vec3";
import type { Lamp, TraceSettings } from "./path_trace_settings";
import type { QualityLevel } from "./quality_controller";
import type { Plane } from "./transfer_functions_2d";
import type { Mode, Tool } from "./viewer_state";

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
