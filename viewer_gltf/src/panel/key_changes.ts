/** Changes of the keys by the user. Pure; loaded together with the list of keys. */
import type { Refusal } from "./controls";
import { no } from "./key";
import type { KeyChanges, KeyTable } from "./keys";

/**
 * The key that opens the list of keys. Users cannot change it, so that they can always open the
 * list and restore their keys.
 */
export const FIXED = "?";
/** Keys that operate controls, or that the browser uses. */
const TAKEN = /^(Shift\+)?(Tab|Enter|Escape| |F\d+)$|^Ctrl\+/;

/** Returns the key that has the function of `name` in the tables. */
export function keyNow(name: string, changes: KeyChanges): string {
  return changes[name] ?? name;
}

/** Gives `pressed` the function of `name` in the tables. Returns a refusal if that is not possible. */
export function changeKey(
  table: KeyTable,
  changes: KeyChanges,
  name: string,
  pressed: string,
): Readonly<{ changes: KeyChanges }> | Refusal {
  const owner = table.standsFor(pressed, changes);
  if (owner !== null && owner !== name) {
    return no(
      `That key is used for “${table.labelOf(owner)}”: press another key, or change that one first.`,
    );
  }
  const { [name]: _, ...others } = changes;
  if (pressed === name) return { changes: others };
  if (pressed === FIXED || TAKEN.test(pressed)) {
    return no("That key belongs to the browser or the page: press another key.");
  }
  return { changes: { ...others, [name]: pressed } };
}
