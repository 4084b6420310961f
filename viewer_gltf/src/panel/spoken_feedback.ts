/** Announces the effect of a key, because the user may not see the control that it stands for. Pure. */

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
import type { Request } from "./controls";
import { changeText, SHAPE_NUMBERS } from "./edit_shapes";
import { LENS_NAMES } from "./lenses";
import { measuredText } from "./measured";
import { transferTitle } from "./transfer_titles";
import { type Ranges, windowTexts } from "./window_texts";

/** @param state state after the request @returns "" if the view shows the effect */
export function spokenFeedback(
  request: Request,
  before: ViewerState,
  state: ViewerState,
  ranges: Ranges,
): string {
  const text = spokenRequest(request, before, state, ranges);
  if (typeof request === "string" || "panel" in request || !isSame(before, state)) return text;
  return text === "" ? "This changes nothing." : `${text}${whyUnchanged(request, state)}`;
}

/** Returns why an action has changed nothing: a value at its limit, the only choice, or the present choice. */
function whyUnchanged(action: Action, state: ViewerState): string {
  switch (action.type) {
    case "set":
      return typeof action.value === "number" ? ": at its limit" : "";
    case "window":
    case "set-shapes":
      return ": at its limit";
    case "choose-transfer-function":
    case "select":
    case "isolate":
      return isOnlyChoice(action, state) ? ": the only one" : ": already so";
    default:
      return "";
  }
}

/** Returns whether a choice has no alternative: the only tile, or the only transfer function of a channel. */
function isOnlyChoice(
  action: Extract<Action, { type: "choose-transfer-function" | "select" | "isolate" }>,
  { tiles, channels }: ViewerState,
): boolean {
  if (action.type !== "choose-transfer-function") {
    return action.tile !== null && tiles.length === 1;
  }
  return channels.find(({ id }) => id === action.channel)?.transferFunctions.length === 1;
}

/** An edit makes new lists of shapes even if no number changes, so the contents are compared. */
function isSame(before: ViewerState, after: ViewerState): boolean {
  return before === after || JSON.stringify(before) === JSON.stringify(after);
}

function spokenRequest(
  request: Request,
  before: ViewerState,
  state: ViewerState,
  ranges: Ranges,
): string {
  if (typeof request === "string") return "";
  if (!("panel" in request)) {
    if (request.type === "set-clip") return cutText(before.clip, state.clip);
    if (request.type === "set-shapes") return spokenShapes(request.channel, before, state);
    return spokenAction(request, state, ranges);
  }
  if (request.panel === "clip-part") return clipPartName(request.clipPart);
  if (request.panel === "parameter") return parameterOf(request.parameter).spoken(state);
  if (request.panel === "lenses") return `Cardboard viewer: ${LENS_NAMES[request.lenses]}`;
  if (request.panel === "shape") {
    return request.shape === null
      ? ""
      : `Shape ${request.shape.index + 1} of ${request.shape.count}`;
  }
  if (request.panel === "shape-number") {
    return `Shapes: ${SHAPE_NUMBERS.find(({ id }) => id === request.id)?.name ?? request.id}`;
  }
  if (request.panel !== "pick" || request.channel === null) return "";
  return `Channel ${nameOf(request.channel, state)}`;
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
        ? "No tile selected"
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
