/**
 * Ignores the second of two quick presses: users double-click out of habit, and a thumb may bounce.
 * The second press counts only on controls that advance by a step with each press.
 */
import { angleBetween, type RaySample, TREMBLE_RAD } from "./dwell";

/** A press of a button, or a dwell that has fired. */
export type TimedPress = Readonly<{
  /** On the clock of the page's events. */
  time_ms: number;
  sample: RaySample;
  /** Whether each press advances by a step, so that quick presses all count. */
  isStep: boolean;
}>;

/** Milliseconds. Longest time between the two presses of a double press. */
export const DOUBLE_MS = 400;

/** Whether a press is the second press of a double press and is ignored. */
export function isSecondPress(before: TimedPress | null, press: TimedPress): boolean {
  if (before === null || press.time_ms - before.time_ms > DOUBLE_MS) return false;
  const [then, now] = [before.sample, press.sample];
  if (then.target === now.target && then.place === now.place) return !press.isStep;
  // the ray has not moved, but another target has come under it
  const isStill = angleBetween(then.direction, now.direction) <= TREMBLE_RAD;
  return isStill && then.layouts.join() !== now.layouts.join();
}
