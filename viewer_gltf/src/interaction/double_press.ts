/**
 * Two presses in quick succession are one intention: people double-click, and a thumb bounces. The
 * second press does nothing, unless the control moves on by a step with each press. Pure.
 */
import { angleBetween, type RaySample, TREMBLE_RAD } from "./dwell";

/** A press of a button, or a dwell that has fired. */
export type TimedPress = Readonly<{
  /** On the clock of the page's events. */
  time_ms: number;
  sample: RaySample;
  /** Each press moves on by a step, so quick presses all count. */
  isStep: boolean;
}>;

/** Longest time between the two presses of a double press, ms. */
export const DOUBLE_MS = 400;

/** Whether a press is the second one of a double press, and so does nothing. */
export function isSecondPress(before: TimedPress | null, press: TimedPress): boolean {
  if (before === null || press.time_ms - before.time_ms > DOUBLE_MS) return false;
  const [then, now] = [before.sample, press.sample];
  if (then.target === now.target && then.place === now.place) return !press.isStep;
  // the ray has not moved, and another target has come under it
  const isStill = angleBetween(then.direction, now.direction) <= TREMBLE_RAD;
  return isStill && then.layouts.join() !== now.layouts.join();
}
