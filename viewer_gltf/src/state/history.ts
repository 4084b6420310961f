/**
 * Undo and redo. For each step of the user, the history holds the moment before it: the state, and
 * for example the camera. Pure.
 *
 * Changes of the same kind in quick succession, for example by dragging a slider, are one step.
 * Notices, loaded data and the abilities of the device are not steps of the user, so undo leaves
 * them as they are.
 */
import type { Action } from "./actions";
import { channelParameterOf, parameterOf } from "./parameters/table";
import { rulesOf } from "./part_settings";
import type { ChannelState, ViewerState } from "./viewer_state";

/**
 * Largest number of steps that can be undone. States share all values that are equal, so 200 need
 * little memory.
 */
export const MAX_STEPS = 200;
/**
 * Seconds without a change after which the next change is a new step, if no button or key is held
 * down.
 */
export const PAUSE_S = 1;

/**
 * When and how a change was made. A change with the `key` and `gesture` of the previous one may
 * join its step.
 */
export type Occasion = Readonly<{
  /** Key of changes that may be joined to one step; null: the change is a separate step. */
  key: string | null;
  /**
   * Number of times that the user has pressed or released a key or a button so far. Changes with an
   * equal number belong to one gesture.
   */
  gesture: number;
  isHeld: boolean;
  time_s: number;
}>;

type Step<T> = Readonly<{ before: T; name: string }>;
export type History<T> = Readonly<{
  past: readonly Step<T>[];
  /** Undone steps. Here, `before` is the moment to which redo leads, after the step. */
  future: readonly Step<T>[];
  last: Occasion | null;
}>;

export const NO_HISTORY: History<never> = { past: [], future: [], last: null };

/** @param before the moment before this change */
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

/**
 * Undoes the last step. Returns the state before it (`moment`) and the new history; null if there is
 * no step.
 */
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

/**
 * Redoes the last undone step. Returns the state after it (`moment`) and the new history; null if
 * there is no undone step.
 */
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

/** Returns whether a user sees no difference between two states. */
export function isSameView(a: ViewerState, b: ViewerState): boolean {
  if (a === b) return true;
  const { channels: ofA, ...restA } = withoutUserChanges(a, b);
  const { channels: ofB, ...restB } = b;
  return isShallowEqual(restA, restB) && ofA.every((each, i) => isShallowEqual(each, ofB[i]));
}

/**
 * Returns an earlier state with the notices, loaded data and device abilities of the present one.
 */
export function withoutUserChanges(then: ViewerState, now: ViewerState): ViewerState {
  const { notices, retryable, canTrace, tiles, middle } = now;
  const channels = then.channels.map((channel): ChannelState => {
    const transfer2d = now.channels.find(({ id }) => id === channel.id)?.transfer2d ?? null;
    return channel.transfer2d === transfer2d ? channel : { ...channel, transfer2d };
  });
  return { ...then, channels, notices, retryable, canTrace, tiles, middle };
}

function isShallowEqual(a: object, b: object): boolean {
  const [ofA, ofB] = [a, b].map((each) => new Map(Object.entries(each)));
  return ofA.size === ofB.size && [...ofA].every(([key, value]) => ofB.get(key) === value);
}

/**
 * Returns the key by which gradual changes are joined to one step; null: each change is a step of
 * its own.
 */
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

/** Returns what a step changes, in a few words. */
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
      return "selected tile";
    case "isolate":
      return "isolated tile";
    case "set-clip":
      return "cut";
    case "measure":
    case "add-point":
    case "finish-measuring":
    case "set-measurements":
      return "measurement";
    case "move-lamp":
      return "lamp";
    case "keep-views":
      return "kept views";
    default:
      return rulesOf(action)?.name ?? "";
  }
}
