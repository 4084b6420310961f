/** The share of a screen's pixels that are drawn, along an edge: fewer after a reload that the graphics driver needed. */
import { store, stored } from "../dom/stored";

/** The tab keeps it: a new tab begins with all pixels. */
const KEY = "stereocell-pixels";
const LEAST = 0.25;

export function pixelShare(): number {
  const share = Number(stored(KEY, "in-tab") ?? 1);
  return share >= LEAST && share <= 1 ? share : 1;
}

/** From the next opening on, half as many pixels along an edge. */
export function takeFewerPixels(): void {
  store(KEY, String(Math.max(LEAST, pixelShare() / 2)), "in-tab");
}
