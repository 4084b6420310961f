/** Changing the keys: which key may do what. Pure; it comes with the list of keys. */
import type { Refusal } from "./controls";
import { no } from "./key";
import type { KeyChanges, KeyTable } from "./keys";

/** The key of this list stays, so that everybody finds the way back. */
export const FIXED = "?";
/** Controls are worked by these, or the browser has them. */
const TAKEN = /^(Shift\+)?(Tab|Enter|Escape| |F\d+)$|^Ctrl\+/;

/** The key that does what `name` does in the tables. */
export function keyNow(name: string, changes: KeyChanges): string {
  return changes[name] ?? name;
}

/** Let `pressed` do what `name` does in the tables; a refusal says why it can't. */
export function changeKey(
  table: KeyTable,
  changes: KeyChanges,
  name: string,
  pressed: string,
): Readonly<{ changes: KeyChanges }> | Refusal {
  const owner = table.standsFor(pressed, changes);
  if (owner !== null && owner !== name) {
    return no(
      `That key does “${table.labelOf(owner)}”: press another one, or change that one first.`,
    );
  }
  const { [name]: _, ...others } = changes;
  if (pressed === name) return { changes: others };
  if (pressed === FIXED || TAKEN.test(pressed)) {
    return no("That key belongs to the browser or to the page: press another one.");
  }
  return { changes: { ...others, [name]: pressed } };
}
