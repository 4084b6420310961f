/**
 * The user's lens profile, screen size and eye settings, kept in the browser since the last visit.
 */
import { store, stored } from "../dom/stored";
import type { PanelView } from "../panel/controls";
import type { Action } from "../state/actions";
import { setTo } from "../state/parameters/kinds";
import { EYE_DISTANCE, STEREO_STRENGTH } from "../state/parameters/tools";
import { PER_INCH } from "../state/stereo";
import type { ViewerState } from "../state/viewer_state";
import { BUILT_IN } from "../xr/cardboard/viewer_profile";

const LENS_KEY = "stereocell-lens";
const SCREEN_KEY = "stereocell-screen";
const EYES_KEY = "stereocell-eyes";
const EYE_ROWS = [EYE_DISTANCE, STEREO_STRENGTH] as const;

type LensView = Pick<PanelView, "lenses" | "code">;

export function rememberedLens(): Partial<LensView> {
  try {
    const { lenses, code } = JSON.parse(stored(LENS_KEY) ?? "{}");
    const isKnown = lenses === "own" || lenses in BUILT_IN;
    return isKnown && typeof code === "string" ? { lenses, code } : {};
  } catch {
    return {}; // the stored text is not from this page
  }
}

export function rememberLens({ lenses, code }: LensView): void {
  store(LENS_KEY, JSON.stringify({ lenses, code }));
}

/** CSS pixels per inch of this screen, if it was measured; otherwise null. */
export function rememberedScreen(): number | null {
  const [least, most] = PER_INCH;
  const perInch = Number(stored(SCREEN_KEY));
  return perInch >= least && perInch <= most ? perInch : null;
}

export function rememberScreen(perInch: number): void {
  store(SCREEN_KEY, String(perInch));
}

export function rememberedEyes(): readonly Action[] {
  const texts = (stored(EYES_KEY) ?? "").split(",");
  return EYE_ROWS.flatMap((row, i) => {
    const value = Number(texts[i] || Number.NaN);
    return Number.isFinite(value) ? [setTo(row, value)] : [];
  });
}

export function rememberEyes(state: ViewerState, previous: ViewerState): void {
  const [eyes, before] = [state, previous].map((each) =>
    EYE_ROWS.map((row) => row.get(each)).join(),
  );
  if (eyes !== before) store(EYES_KEY, eyes);
}
