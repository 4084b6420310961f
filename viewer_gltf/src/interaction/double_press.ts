/**
 * Two presses in quick succession are one intention: people double-click, and a thumb bounces. The
 * second one does nothing, unless the control goes on by a step with each press. Pure.
 */
import { angleBetween, type Sight, TREMBLE_RAD } from "./dwell";

/** A press of a button, or a dwell that has fired. */
export type Press = Readonly<{
  /** On the clock of the page's events. */
  time_ms: number;
  sight: Sight;
  /** Each press goes on by a step: pressing quickly is meant. */
  isStep: boolean;
}>;

/** Longest time between the two presses of a double press, ms. */
export const DOUBLE_MS = 400;

/** Whether a press belongs to the one before it, and so is to do nothing. */
export function isSecondPress(before: Press | null, press: Press): boolean {
  if (before === null || press.time_ms - before.time_ms > DOUBLE_MS) return false;
  const [then, now] = [before.sight, press.sight];
  if (then.target === now.target && then.place === now.place) return !press.isStep;
  // the ray has stayed, and something else has come under it
  const isStill = angleBetween(then.direction, now.direction) <= TREMBLE_RAD;
  return isStill && then.layout !== now.layout;
}
