/** The card before the eyes when stereo begins: how the bar is found and how something is chosen. */
import type { Setting } from "./panel/placement";

/** The text of the card. Before a head that looks at a table the bar is higher than the gaze. */
export function howItWorks(setting: Setting): string {
  const way = setting === "over-table" ? "up" : "down";
  return `Look ${way}: the bar.\nRest or press: choose.\nHold: it follows you.`;
}
/** Times that the card is shown on a device. */
const TOLD_OFTEN = 3;
const TOLD_KEY = "stereocell-told";

/** Whether the card is shown this time, which counts. */
export function isToBeTold(): boolean {
  try {
    const times = Number(localStorage.getItem(TOLD_KEY) ?? 0);
    localStorage.setItem(TOLD_KEY, String(times + 1));
    return times < TOLD_OFTEN;
  } catch {
    return true; // nothing can be kept here
  }
}
