/** What a key has done, in words: whoever uses keys may not see the control that it stands for. Pure. */

import type { Action } from "../state/actions";
import { DIALS, dialName } from "../state/path_trace_parameters";
import type { TraceSettings } from "../state/path_trace_settings";
import { shapesOf } from "../state/transfer_functions_2d";
import type { ViewerState } from "../state/viewer_state";
import { cutText, gripName } from "./clip_by_key";
import type { Wish } from "./controls";
import { changeText, SHAPE_NUMBERS } from "./edit_shapes";
import { measuredText } from "./layout";
import { intensityText, type Ranges } from "./sections/channels";
import { LENS_NAMES } from "./sections/stereo";

/** @param state after the wish was granted; "" where the picture says it all */
export function told(wish: Wish, before: ViewerState, state: ViewerState, ranges: Ranges): string {
  if (typeof wish === "string") return "";
  if (!("panel" in wish)) {
    if (wish.type === "set-clip") return cutText(before.clip, state.clip);
    if (wish.type === "set-shapes") return toldShapes(wish.channel, before, state);
    return toldAction(wish, state, ranges);
  }
  if (wish.panel === "grip") return gripName(wish.grip);
  if (wish.panel === "dial") {
    const dial = DIALS.find(({ id }) => id === wish.dial);
    return dial === undefined ? "" : `${dialName(dial)}: ${dial.text(dial.of(state.trace))}`;
  }
  if (wish.panel === "lenses") return `Phone viewer: ${LENS_NAMES[wish.lenses]}`;
  if (wish.panel === "shape") {
    return wish.shape === null ? "" : `Shape ${wish.shape.index + 1} of ${wish.shape.count}`;
  }
  if (wish.panel === "shape-number") {
    return `Shapes: ${SHAPE_NUMBERS.find(({ id }) => id === wish.id)?.name ?? wish.id}`;
  }
  if (wish.panel !== "pick" || wish.channel === null) return "";
  return `Channel ${nameOf(wish.channel, state)}`;
}

function toldShapes(id: string, before: ViewerState, state: ViewerState): string {
  const [was, is] = [before, state].map(({ channels }) => channels.find((each) => each.id === id));
  if (was === undefined || is === undefined) return "";
  const text = changeText(shapesOf(was, is.transferFunction), shapesOf(is));
  return `${is.name}, ${is.transferFunction}: ${text}`;
}

function nameOf(id: string, { channels }: ViewerState): string {
  return channels.find((channel) => channel.id === id)?.name ?? id;
}

function toldAction(action: Action, state: ViewerState, ranges: Ranges): string {
  if ("channel" in action) return toldChannel(action, state, ranges);
  switch (action.type) {
    case "select":
      return action.tile === null ? "No tile chosen" : `Tile ${action.tile}`;
    case "isolate":
      return action.tile === null ? "All tiles" : `Only tile ${action.tile}`;
    case "choose-mode":
      return `Volumes: ${state.mode}`;
    case "set-switch-distance":
      return `Volumes within ${state.switchDistance_m.toPrecision(2)} m`;
    case "set-disc-radius":
      return `Disc ${Number(state.discRadius_deg.toFixed(1))}°`;
    case "choose-tool":
      return state.tool === "measure" ? measuredText(state) : "A tap selects";
    case "measure":
      return measuredText(state);
    case "set-dwell":
      return `Choosing by gaze: ${state.isDwellOn ? "on" : "off"}`;
    case "trace":
    case "move-lamp":
      return toldLight(action, state.trace);
    case "show-lamps":
      return toldLamps(state);
    case "choose-quality":
      return `Quality: ${state.quality}`;
    default:
      return "";
  }
}

function toldLight(
  action: Extract<Action, { type: "trace" | "move-lamp" }>,
  trace: TraceSettings,
): string {
  const [changed, ...others] = Object.keys(action.change);
  if (action.type === "move-lamp") {
    const lamp = `Lamp ${action.lamp + 1}`;
    if (changed === "isOn") return `${lamp}: ${trace.lamps[action.lamp].isOn ? "on" : "off"}`;
    if (changed === "color") return `${lamp}: another colour`;
    if (others.length > 0) return `${lamp}: moved`;
  }
  const id = action.type === "trace" ? changed : `lamp-${action.lamp}/${changed}`;
  const dial = DIALS.find((each) => each.id === id);
  if (dial !== undefined) return `${dialName(dial)}: ${dial.text(dial.of(trace))}`;
  if (changed === "environment") return `Room: ${trace.environment}`;
  if (changed === "isMultiple") return `Scattered ${trace.isMultiple ? "many times" : "once"}`;
  if (changed === "isPostOn") return trace.isPostOn ? "After" : "Before";
  return `Tone map: ${trace.toneMap}`;
}

function toldLamps({ areLampsShown, trace }: ViewerState): string {
  if (!areLampsShown) return "Lamps hidden";
  return trace.lamps.some(({ isOn }) => isOn) ? "Lamps shown: drag them" : "No lamp is on";
}

function toldChannel(
  { channel: id, type }: Extract<Action, { channel: string }>,
  state: ViewerState,
  ranges: Ranges,
): string {
  const channel = state.channels.find((each) => each.id === id);
  if (channel === undefined) return "";
  const { name, window } = channel;
  switch (type) {
    case "show":
      return `${name}: ${channel.shown ? "shown" : "hidden"}`;
    case "fade":
      return `${name}: opacity ${Math.round(100 * channel.opacity)} %`;
    case "window": {
      const ends = window.map((end) => intensityText(end, ranges.get(id)));
      return `${name}: window ${ends.join(" – ")}`;
    }
    case "draw-volume":
      return `${name}: volume ${channel.volume ? "on" : "off"}`;
    case "choose-transfer-function":
    case "set-shapes":
    case "learn-plane":
      return `${name}: ${channel.transferFunction}`;
    case "recolor":
      return `${name}: another colour`;
  }
}
