/** The effect of a key, in words: the user may not see the control that it stands for. Pure. */

import { measurementText } from "../probe/measure";
import type { Action } from "../state/actions";
import type { SetAction } from "../state/parameters/kinds";
import { channelParameterOf, parameterOf } from "../state/parameters/table";
import { TOOL } from "../state/parameters/tools";
import { rulesOf } from "../state/part_settings";
import { tileName } from "../state/tile_name";
import { shapesOf } from "../state/transfer_functions_2d";
import type { ViewerState } from "../state/viewer_state";
import { clipPartName, cutText } from "./clip_by_key";
import type { Wish } from "./controls";
import { changeText, SHAPE_NUMBERS } from "./edit_shapes";
import { LENS_NAMES } from "./lenses";
import { measuredText } from "./measured";
import { transferTitle } from "./transfer_titles";
import { type Ranges, windowTexts } from "./window_texts";

/** @param state after the wish was granted; "" where the picture shows it all */
export function spokenFeedback(
  wish: Wish,
  before: ViewerState,
  state: ViewerState,
  ranges: Ranges,
): string {
  const text = spokenWish(wish, before, state, ranges);
  if (typeof wish === "string" || "panel" in wish || !isSame(before, state)) return text;
  return text === "" ? "That changes nothing." : `${text}${whyUnchanged(wish)}`;
}

/** Why an action has left all as it was: a step that has an end, or the next one of several. */
function whyUnchanged(action: Action): string {
  switch (action.type) {
    case "set":
      return typeof action.value === "number" ? ": it goes no further" : "";
    case "window":
    case "set-shapes":
      return ": it goes no further";
    case "choose-transfer-function":
    case "select":
    case "isolate":
      return ": there is no other";
    default:
      return "";
  }
}

/** Tables of shapes are made anew by an edit that changes none of their numbers. */
function isSame(before: ViewerState, after: ViewerState): boolean {
  return before === after || JSON.stringify(before) === JSON.stringify(after);
}

function spokenWish(wish: Wish, before: ViewerState, state: ViewerState, ranges: Ranges): string {
  if (typeof wish === "string") return "";
  if (!("panel" in wish)) {
    if (wish.type === "set-clip") return cutText(before.clip, state.clip);
    if (wish.type === "set-shapes") return spokenShapes(wish.channel, before, state);
    return spokenAction(wish, state, ranges);
  }
  if (wish.panel === "clip-part") return clipPartName(wish.clipPart);
  if (wish.panel === "parameter") return parameterOf(wish.parameter).spoken(state);
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

function spokenShapes(id: string, before: ViewerState, state: ViewerState): string {
  const [was, is] = [before, state].map(({ channels }) => channels.find((each) => each.id === id));
  if (was === undefined || is === undefined) return "";
  const text = changeText(shapesOf(was, is.transferFunction), shapesOf(is));
  return `${is.name}, ${is.transferFunction}: ${text}`;
}

function nameOf(id: string, { channels }: ViewerState): string {
  return channels.find((channel) => channel.id === id)?.name ?? id;
}

function spokenAction(action: Action, state: ViewerState, ranges: Ranges): string {
  if ("channel" in action) return spokenChannel(action, state, ranges);
  switch (action.type) {
    case "set":
      if (action.id === TOOL.id && state.tool === "measure") return measuredText(state);
      return parameterOf(action.id).spoken(state);
    case "select":
      return action.tile === null
        ? "No tile chosen"
        : `Tile: ${tileName(action.tile, state.tiles)}`;
    case "isolate":
      return action.tile === null ? "All tiles" : `Only ${tileName(action.tile, state.tiles)}`;
    case "measure":
    case "add-point":
      return measuredText(state);
    case "finish-measuring": {
      const made = state.measurements.at(-1);
      return made === undefined ? "" : `${made.name}: ${measurementText(made.kind, made.points)}`;
    }
    case "set-measurements":
      return `${state.measurements.length} measurements`;
    case "move-lamp":
      return `Lamp ${action.lamp + 1}: moved`;
    default:
      return rulesOf(action)?.spoken(state) ?? "";
  }
}

function spokenChannel(
  action: Extract<Action, { channel: string }> | SetAction,
  state: ViewerState,
  ranges: Ranges,
): string {
  const channel = state.channels.find((each) => each.id === action.channel);
  if (channel === undefined) return "";
  const { id, name, window } = channel;
  switch (action.type) {
    case "set":
      return `${name}: ${channelParameterOf(action.id).spoken(channel)}`;
    case "show":
      return `${name}: ${channel.shown ? "shown" : "hidden"}`;
    case "window": {
      return `${name}: window ${windowTexts(window, ranges.get(id)).join(" – ")}`;
    }
    case "choose-transfer-function":
    case "set-shapes":
    case "objects":
    case "learn-transfer-2d":
      return `${name}: ${transferTitle(channel)}`;
  }
}
