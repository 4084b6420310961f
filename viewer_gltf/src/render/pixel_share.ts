/**
 * Share of the screen's pixels that are drawn, along an edge. It shrinks after a reload that a
 * failing graphics driver forced.
 */
import { store, stored } from "../dom/stored";

/** Key in the tab's storage, so a new tab begins with all pixels. */
const KEY = "stereocell-pixels";
const LEAST = 0.25;

export function pixelShare(): number {
  const share = Number(stored(KEY, "in-tab") ?? 1);
  return share >= LEAST && share <= 1 ? share : 1;
}

/** Halves the share of the pixels, from the next time on that the page opens. */
export function halvePixelShare(): void {
  store(KEY, String(Math.max(LEAST, pixelShare() / 2)), "in-tab");
}
