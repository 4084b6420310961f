/** The panel's state on the user's previous visit. */
import { store, stored } from "../dom/stored";
import { type PanelChange, type PanelView, START_VIEW } from "../panel/controls";
import type { KeyChanges } from "../panel/keys";

const OPEN_KEY = "stereocell-open";
const LETTERS_KEY = "stereocell-letters";
const KEYS_KEY = "stereocell-keys";

export function rememberedView(): Partial<PanelView> {
  return {
    open: rememberedOpen(),
    hasLetters: stored(LETTERS_KEY) !== "off",
    keyChanges: rememberedKeys(),
  };
}

/** Returns the keys that the user has changed. */
function rememberedKeys(): KeyChanges {
  try {
    const found: unknown = JSON.parse(stored(KEYS_KEY) ?? "{}");
    const pairs = Object.entries(found ?? {}).filter((pair) => typeof pair[1] === "string");
    return Object.fromEntries(pairs);
  } catch {
    return {}; // the stored text is damaged: the original keys apply
  }
}

/**
 * Returns the open sections, except those of label maps, which would move the rows below when their
 * table is loaded.
 */
function rememberedOpen(): readonly string[] {
  const text = stored(OPEN_KEY);
  const sections = text === null ? START_VIEW.open : text.split(" ");
  return sections.filter((id) => !id.startsWith("objects"));
}

/** @param view the panel's state after the change */
export function rememberChange(change: PanelChange, view: PanelView): void {
  if (change.panel === "unfold") store(OPEN_KEY, view.open.join(" "));
  if (change.panel === "letters") store(LETTERS_KEY, change.areOn ? "on" : "off");
  if (change.panel === "keys") store(KEYS_KEY, JSON.stringify(change.changes));
}
