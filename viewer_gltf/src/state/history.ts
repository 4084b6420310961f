/**
 * Undo and redo: the moments that a user has made, each a state and what else belongs to it. Pure.
 *
 * Changes of one kind that follow each other at once, as those of a slider that is dragged, are one
 * step. Notices, what has been loaded since, and what the device can do are no user's: they stay.
 */
import type { Action } from "./actions";
import { channelParameterOf, parameterOf } from "./parameters/table";
import { rulesOf } from "./part_settings";
import type { ChannelState, ViewerState } from "./viewer_state";

/** Most steps back: so many states share all that they have in common. */
export const MAX_STEPS = 200;
/** Longest pause within one step, s, where nothing is held down. */
export const PAUSE_S = 1;

/** When and how a change was made: of the same `key` and `gesture` it may belong to the step before. */
export type Occasion = Readonly<{
  /** null: a step of its own. */
  key: string | null;
  /** Counts what was pressed and let go. */
  gesture: number;
  isHeld: boolean;
  time_s: number;
}>;

type Step<T> = Readonly<{ before: T; name: string }>;
export type History<T> = Readonly<{
  past: readonly Step<T>[];
  /** `before` is the moment that redoing leads to. */
  future: readonly Step<T>[];
  last: Occasion | null;
}>;

export const NO_HISTORY: History<never> = { past: [], future: [], last: null };

/** @param before the moment that this change has ended */
export function withStep<T>(
  history: History<T>,
  before: T,
  name: string,
  occasion: Occasion,
): History<T> {
  const { past, last } = history;
  const isSame =
    past.length > 0 &&
    last !== null &&
    occasion.key !== null &&
    last.key === occasion.key &&
    last.gesture === occasion.gesture &&
    (occasion.isHeld || occasion.time_s - last.time_s < PAUSE_S);
  const steps = isSame ? past : [...past, { before, name }].slice(-MAX_STEPS);
  return { past: steps, future: [], last: occasion };
}

/** The moment before and the history then; null: there is none. */
export function undone<T>(
  { past, future }: History<T>,
  now: T,
): Readonly<{ moment: T; history: History<T>; name: string }> | null {
  const step = past.at(-1);
  if (step === undefined) return null;
  const { before, name } = step;
  const ahead = [{ before: now, name }, ...future];
  return { moment: before, history: { past: past.slice(0, -1), future: ahead, last: null }, name };
}

/** The moment that was undone last and the history then; null: there is none. */
export function redone<T>(
  { past, future }: History<T>,
  now: T,
): Readonly<{ moment: T; history: History<T>; name: string }> | null {
  const [step, ...ahead] = future;
  if (step === undefined) return null;
  const { before: moment, name } = step;
  const behind = [...past, { before: now, name }];
  return { moment, history: { past: behind, future: ahead, last: null }, name };
}

/** Whether a user sees no change between two states. */
export function isSameView(a: ViewerState, b: ViewerState): boolean {
  if (a === b) return true;
  const { channels: ofA, ...restA } = withOwn(a, b);
  const { channels: ofB, ...restB } = b;
  return isShallowEqual(restA, restB) && ofA.every((each, i) => isShallowEqual(each, ofB[i]));
}

/** A state of before, with all of the present one that is no user's. */
export function withOwn(then: ViewerState, now: ViewerState): ViewerState {
  const { notices, mendable, canTrace, tiles, middle } = now;
  const channels = then.channels.map((channel): ChannelState => {
    const transfer2d = now.channels.find(({ id }) => id === channel.id)?.transfer2d ?? null;
    return channel.transfer2d === transfer2d ? channel : { ...channel, transfer2d };
  });
  return { ...then, channels, notices, mendable, canTrace, tiles, middle };
}

function isShallowEqual(a: object, b: object): boolean {
  const [ofA, ofB] = [a, b].map((each) => new Map(Object.entries(each)));
  return ofA.size === ofB.size && [...ofA].every(([key, value]) => ofB.get(key) === value);
}

/** What changes little by little, and so may be one step; null: each change is one. */
export function keyOfChange(action: Action): string | null {
  switch (action.type) {
    case "set": {
      const { id, channel } = action;
      const { kind } = channel === undefined ? parameterOf(id) : channelParameterOf(id);
      return kind === "number" || kind === "colour" ? `set ${id} ${channel ?? ""}` : null;
    }
    case "objects":
      return `${action.type} ${action.channel} ${Object.keys(action.change)}`;
    case "window":
    case "set-shapes":
      return `${action.type} ${action.channel}`;
    case "move-lamp":
      return `${action.type} ${action.lamp}`;
    case "set-clip":
    case "set-measurements":
      return action.type;
    default:
      return rulesOf(action)?.isGradual ? action.type : null;
  }
}

/** What a step changes, in a few words. */
export function nameOfChange(action: Action, { channels }: ViewerState): string {
  const nameOf = (id: string) => channels.find((each) => each.id === id)?.name ?? id;
  switch (action.type) {
    case "set":
      return action.channel === undefined
        ? parameterOf(action.id).label
        : `${nameOf(action.channel)}: ${channelParameterOf(action.id).label}`;
    case "show":
      return `${nameOf(action.channel)}: ${action.shown ? "shown" : "hidden"}`;
    case "objects":
      return `${nameOf(action.channel)}: objects`;
    case "window":
      return `${nameOf(action.channel)}: window`;
    case "choose-transfer-function":
      return `${nameOf(action.channel)}: transfer function`;
    case "set-shapes":
      return `${nameOf(action.channel)}: shapes`;
    case "select":
      return "chosen tile";
    case "isolate":
      return "only tile";
    case "set-clip":
      return "cut";
    case "measure":
    case "add-point":
    case "finish-measuring":
    case "set-measurements":
      return "measuring";
    case "move-lamp":
      return "lamp";
    case "keep-views":
      return "kept views";
    default:
      return rulesOf(action)?.name ?? "";
  }
}
