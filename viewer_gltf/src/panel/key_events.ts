/** Keys as the browser reports them: their names, and the elements that want them too. */

type Pressed = Pick<KeyboardEvent, "key" | "code" | "shiftKey"> &
  Partial<Pick<KeyboardEvent, "ctrlKey" | "metaKey">>;

/**
 * The name of a key that was pressed: as `KeyboardEvent.key` has it, with Shift where that leaves no
 * mark on it, with Ctrl for Ctrl and for a Mac's Command. Where a keyboard writes other letters than
 * Latin ones, their place counts.
 */
export function keyName(pressed: Pressed): string {
  const name = plainName(pressed);
  if (!pressed.ctrlKey && !pressed.metaKey) return name;
  // whatever Caps Lock makes of the letter
  return `Ctrl+${pressed.shiftKey ? name.toUpperCase() : name.toLowerCase()}`;
}

/** Whether a key writes something: one character, and no space. */
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
 * What has the keyboard. A text field takes every key; a control those that it is worked by: a
 * button is pressed, a list (or a slider, or radio buttons) is gone through as well.
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
  const plain = name.replace(/^Shift\+/, ""); // which changes nothing to a control
  return !PRESS.includes(plain) && !(focus === "list" && GO_THROUGH.includes(plain));
}

const TEXT_INPUTS = ["text", "search", "url", "number", "email", "password", "tel"];

/** Groups of buttons with one stop of the Tab key take their arrows themselves: see roving_tabindex.ts. */
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

/** @param onKey returns whether the key did something: then the browser does nothing with it */
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
        target.blur(); // what was typed stays
        event.preventDefault();
      }
    },
    { signal },
  );
}
