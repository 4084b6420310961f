/** Returns the state after an action. Pure. */
import type { Action } from "./actions";
import { withoutUserChanges } from "./history";
import { MAX_VIEWS } from "./kept_views";
import { finished, MAX_POINTS, withinLimits, withPoint } from "./measurements";
import { withObjects } from "./objects";
import { withValue } from "./parameters/kinds";
import { LAMP } from "./parameters/light";
import { faultOfValue, withParameter } from "./parameters/table";
import { withPartAction } from "./part_settings";
import { withShapes } from "./transfer_functions_2d";
import { type ChannelState, MAX_CHANNELS, type ViewerState } from "./viewer_state";

function withChannel(
  state: ViewerState,
  id: string,
  change: (channel: ChannelState) => ChannelState,
): ViewerState {
  const channels = state.channels.map((c) => (c.id === id ? change(c) : c));
  return channels.every((c, i) => c === state.channels[i]) ? state : { ...state, channels };
}

function withNotice(state: ViewerState, text: string): ViewerState {
  return { ...state, notices: [...state.notices.filter((n) => n !== text), text] };
}

function withRetryable(state: ViewerState, text: string, isRetryable: boolean): ViewerState {
  const others = state.retryable.filter((n) => n !== text);
  return { ...state, retryable: isRetryable ? [...others, text] : others };
}

/**
 * Shows a channel. If there are too many, the channel that has been shown longest is hidden (see
 * announce_change.ts).
 */
function withShown(state: ViewerState, id: string): ViewerState {
  const channel = state.channels.find((c) => c.id === id);
  if (channel === undefined || channel.shown) return state;
  const turn = Math.max(0, ...state.channels.map((c) => c.turn + 1));
  const shown = state.channels.filter((c) => c.shown).sort((a, b) => a.turn - b.turn);
  const next = withChannel(state, id, (c) => ({ ...c, shown: true, turn }));
  const [oldest] = shown;
  if (shown.length < MAX_CHANNELS) return next;
  return withChannel(next, oldest.id, (c) => ({ ...c, shown: false }));
}

const clamp = (value: number, low: number, high: number) => Math.min(high, Math.max(low, value));

/** Smallest width of a window, 0..1. A narrower window would cover a single step of 8 bits. */
const NARROWEST_WINDOW = 1 / 128;

/** Returns the next state: the same object if the action changes nothing. */
export function reduce(state: ViewerState, action: Action): ViewerState {
  switch (action.type) {
    case "set": {
      const { id, value, channel } = action;
      const fault = channel === undefined ? faultOfValue(state, id, value) : null;
      return fault === null ? withParameter(state, action) : withNotice(state, fault);
    }
    case "move-lamp":
      return (LAMP[action.lamp]?.place ?? []).reduce(
        (moved, axis, i) => withValue(axis, moved, action.place[i]),
        state,
      );
    case "objects": {
      const objects = withObjects(state.objects, action);
      return objects === state.objects ? state : { ...state, objects };
    }
    case "show":
      if (action.shown) return withShown(state, action.channel);
      return withChannel(state, action.channel, (c) => ({ ...c, shown: false }));
    case "window": {
      const low = clamp(action.window[0], 0, 1 - NARROWEST_WINDOW);
      const high = clamp(action.window[1], low + NARROWEST_WINDOW, 1);
      return withChannel(state, action.channel, (c) =>
        c.window[0] === low && c.window[1] === high ? c : { ...c, window: [low, high] },
      );
    }
    case "choose-transfer-function":
      return withChannel(state, action.channel, (c) =>
        c.transferFunctions.includes(action.name) && c.transferFunction !== action.name
          ? { ...c, transferFunction: action.name }
          : c,
      );
    case "set-shapes":
      return withChannel(state, action.channel, (c) => withShapes(c, action.name, action.shapes));
    case "learn-transfer-2d":
      return withChannel(state, action.channel, (c) => ({ ...c, transfer2d: action.transfer2d }));
    case "select":
      return withTile(state, "selected", action.tile);
    case "isolate":
      // the isolated tile is also the selected one, so that `back` leads from one to the other
      return withTile(
        action.tile === null ? state : withTile(state, "selected", action.tile),
        "isolated",
        action.tile,
      );
    case "set-clip":
      return { ...state, clip: action.clip };
    case "measure":
      return {
        ...state,
        measured: action.points.slice(-MAX_POINTS),
        measuredAs: state.measureKind,
      };
    case "add-point":
      return withPoint(state, action.point);
    case "finish-measuring":
      return finished(state);
    case "set-measurements":
      return { ...state, measurements: withinLimits(action.measurements) };
    case "keep-views":
      return { ...state, keptViews: action.views.slice(-MAX_VIEWS) };
    case "restore":
      return withoutUserChanges(action.state, state);
    case "notify":
      return withRetryable(
        withNotice(state, action.text),
        action.text,
        action.isRetryable === true,
      );
    case "dismiss": {
      const isLeft = (notice: string) => !action.texts.includes(notice);
      const notices = state.notices.filter(isLeft);
      if (notices.length === state.notices.length) return state;
      return { ...state, notices, retryable: state.retryable.filter(isLeft) };
    }
    default:
      return withPartAction(state, action);
  }
}

function withTile(
  state: ViewerState,
  key: "selected" | "isolated",
  tile: string | null,
): ViewerState {
  const isThere = tile === null || state.tiles.some(({ id }) => id === tile);
  if (!isThere || state[key] === tile) return state;
  return { ...state, [key]: tile };
}

/** Returns the notice that a change has added, even if it existed before; null: none. */
export function newNotice(before: ViewerState, after: ViewerState): string | null {
  const isNew = after.notices !== before.notices && after.notices.length >= before.notices.length;
  return (isNew && after.notices.at(-1)) || null;
}
