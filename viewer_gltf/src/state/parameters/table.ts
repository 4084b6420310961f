/** All parameters, and the action that sets one of them. Pure. */
import { addressRowsOfParts, rowsOfParts } from "../part_settings";
import type { ChannelState, ViewerState } from "../viewer_state";
import { CHANNEL } from "./channel";
import { type Parameter, type SetAction, type Value, withValue } from "./kinds";
import { LAMPS_SHOWN, LIGHT } from "./light";
import {
  MEASURE_PARAMETERS,
  QUALITY,
  QUALITY_PARAMETERS,
  SCREEN_STEREO,
  STEREO_PARAMETERS,
} from "./tools";
import { DISC_RADIUS, MODE, SWITCH_DISTANCE, VOLUMES } from "./volumes";

/** The parameters of neither a channel nor a part. */
const OWN: readonly Parameter<ViewerState>[] = [
  ...VOLUMES,
  ...MEASURE_PARAMETERS,
  SCREEN_STEREO,
  ...STEREO_PARAMETERS,
  ...QUALITY_PARAMETERS,
  ...LIGHT,
  LAMPS_SHOWN,
];

/** Returns all parameters but those of the channels. */
export const allParameters = (): readonly Parameter<ViewerState>[] => [...OWN, ...rowsOfParts()];

const OWN_IN_ADDRESS: readonly Parameter<ViewerState>[] = [
  MODE,
  QUALITY,
  SWITCH_DISTANCE,
  DISC_RADIUS,
  SCREEN_STEREO,
];

/** Returns the parameters that the query of the page's address may set, under the same names as in links. */
export const parametersInAddress = (): readonly Parameter<ViewerState>[] => [
  ...OWN_IN_ADDRESS,
  ...addressRowsOfParts(),
];

const byId = new Map(OWN.map((row) => [row.id, row]));
const channelById = new Map(CHANNEL.map((row) => [row.id, row]));

/**
 * Returns the parameter with an id. Throws Error if there is none: ids come from tables, so that
 * would be a bug.
 */
export function parameterOf(id: string): Parameter<ViewerState> {
  const row = byId.get(id) ?? rowsOfParts().find((each) => each.id === id);
  if (row === undefined) throw new Error(`no parameter ${id}`);
  return row;
}

export function channelParameterOf(id: string): Parameter<ChannelState> {
  const row = channelById.get(id);
  if (row === undefined) throw new Error(`no parameter ${id} of a channel`);
  return row;
}

/** Returns why this device does not support a value; null: it does. */
export function faultOfValue(state: ViewerState, id: string, value: Value): string | null {
  const row = parameterOf(id);
  return row.kind === "choice" ? (row.fault?.(state, String(value)) ?? null) : null;
}

/** Returns the state with a parameter set: the same object if that changes nothing. */
export function withParameter(state: ViewerState, { id, value, channel }: SetAction): ViewerState {
  if (channel === undefined) return withValue(parameterOf(id), state, value);
  const row = channelParameterOf(id);
  const channels = state.channels.map((each) =>
    each.id === channel ? withValue(row, each, value) : each,
  );
  return channels.every((each, i) => each === state.channels[i]) ? state : { ...state, channels };
}
