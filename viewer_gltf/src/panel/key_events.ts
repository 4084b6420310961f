/** Keys as the browser reports them: their names, and the elements that use them themselves. */

type Pressed = Pick<KeyboardEvent, "key" | "code" | "shiftKey"> &
  Partial<Pick<KeyboardEvent, "ctrlKey" | "metaKey">>;

/**
 * Returns the name of a pressed key: `KeyboardEvent.key`, with Shift if the key does not show it,
 * and with Ctrl for Ctrl and for Command on a Mac. On a keyboard without Latin letters, the name is
 * that of the key in the same position on a Latin keyboard.
 */
export function keyName(pressed: Pressed): string {
  const name = plainName(pressed);
  if (!pressed.ctrlKey && !pressed.metaKey) return name;
  // Caps Lock must not change the letter
  return `Ctrl+${pressed.shiftKey ? name.toUpperCase() : name.toLowerCase()}`;
}

/** Returns whether a key writes one character that is not a space. */
export function isWritten(name: string): boolean {
  return [...name].length === 1 && name.trim() !== "";
}

function plainName({ key: written, code, shiftKey }: Pressed): string {
  if (written.length > 1) return shiftKey ? `Shift+${written}` : written;
  const [, letter] = /^Key([A-Z])$/.exec(code) ?? [];
  if (letter === undefined || written <= "~") return written;
  return shiftKey ? letter : letter.toLowerCase();
}

/**
 * The element with the focus. A text field takes every key. A control takes the keys that operate
 * it: Enter and space press a button, and the arrows also change a list, a slider or radio buttons.
 */
export type Focus = "field" | "list" | "button" | "page";

const PRESS = ["Enter", " "];
const GO_THROUGH = [
  ...["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"],
  ...["Home", "End", "PageUp", "PageDown"],
];

export function firesOn(name: string, focus: Focus): boolean {
  if (focus === "page") return true;
  if (focus === "field") return false;
  const plain = name.replace(/^Shift\+/, ""); // Shift makes no difference to a control
  return !PRESS.includes(plain) && !(focus === "list" && GO_THROUGH.includes(plain));
}

const TEXT_INPUTS = ["text", "search", "url", "number", "email", "password", "tel"];

/**
 * Returns the kind of a focused element. Groups of buttons with one Tab stop handle their arrows
 * themselves (see roving_tabindex.ts).
 */
function focusOf(target: EventTarget | null): Focus {
  if (!(target instanceof HTMLElement)) return "page";
  if (target.isContentEditable || target instanceof HTMLTextAreaElement) return "field";
  if (target instanceof HTMLSelectElement) return "list";
  if (target instanceof HTMLInputElement) {
    if (TEXT_INPUTS.includes(target.type)) return "field";
    return target.type === "range" || target.type === "radio" ? "list" : "button";
  }
  return target instanceof HTMLButtonElement ? "button" : "page";
}

/** @param onKey returns whether the key had an effect, in which case the browser ignores it */
export function listenForKeys(onKey: (name: string) => boolean, signal: AbortSignal): void {
  addEventListener(
    "keydown",
    (event) => {
      if (event.defaultPrevented || event.isComposing) return;
      if (event.altKey) return;
      if (document.querySelector("dialog[open]") !== null) return;
      const { target } = event;
      const name = keyName(event);
      const focus = focusOf(target);
      if (firesOn(name, focus)) {
        if (onKey(name)) event.preventDefault();
      } else if (focus === "field" && name === "Escape" && target instanceof HTMLElement) {
        target.blur(); // Escape leaves the field; the typed text stays
        event.preventDefault();
      }
    },
    { signal },
  );
}
