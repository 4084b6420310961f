/**
 * The card in front of the user when stereo begins: how to find the bar and how to choose
 * something.
 */
import type { Setting } from "./panel/placement";

/**
 * The text of the card. In front of a user who looks down at a table, the bar is above the gaze.
 */
export function howItWorks(setting: Setting): string {
  const way = setting === "over-table" ? "up" : "down";
  return `Look ${way} for a bar.\nRest or press to choose.\nHold to move it.`;
}
/** Number of times that the card is shown on a device. */
const TIMES_SHOWN = 3;
const STORAGE_KEY = "stereocell-introductions";

/** Whether the card is due, which also counts this time. */
export function isIntroductionDue(): boolean {
  try {
    const times = Number(localStorage.getItem(STORAGE_KEY) ?? 0);
    localStorage.setItem(STORAGE_KEY, String(times + 1));
    return times < TIMES_SHOWN;
  } catch {
    return true; // nothing can be stored here
  }
}
