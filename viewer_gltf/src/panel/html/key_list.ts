/** The list of all keys, in a dialog that keeps the focus until it is closed. */
import { element } from "../../dom/element";
import { KEYS } from "../keys";

const NAMES: Readonly<Record<string, string>> = {
  ArrowLeft: "←",
  ArrowRight: "→",
  ArrowUp: "↑",
  ArrowDown: "↓",
  Escape: "Esc",
  Delete: "Del",
  Backspace: "⌫",
};

/** With Shift where it belongs to the key. */
function textOf(key: string): string {
  const [, control, letter] = /^(Ctrl\+)(.)$/.exec(key) ?? [];
  if (control !== undefined) {
    const capital = letter.toUpperCase();
    return letter === capital ? `Ctrl ⇧ ${capital}` : `Ctrl ${capital}`;
  }
  const [, shift = "", name = key] = /^(Shift\+)(.+)$/.exec(key) ?? [];
  return `${shift && "⇧ "}${NAMES[name] ?? name}`;
}

/** Of many keys that mean the same, such as the digits, the first and the last. */
function shownKeys(keys: readonly string[]): readonly string[] {
  return keys.length > 3 ? [keys[0], "…", keys[keys.length - 1]] : keys;
}

export class Help {
  private readonly dialog: HTMLDialogElement;

  /** @param onClose called when the user wants it closed, at times once more than needed */
  constructor(parent: HTMLElement, onClose: () => void) {
    const close = element("button", {
      type: "button",
      textContent: "Close",
      onclick: onClose,
    });
    const title = element("h1", { id: "help-title", textContent: "Keys" });
    const groups = KEYS.map(({ name, keys }) =>
      element(
        "section",
        {},
        {},
        element("h2", { textContent: name }),
        element(
          "dl",
          {},
          {},
          ...keys.flatMap((each) => [
            element(
              "dt",
              {},
              {},
              ...shownKeys(each.keys).map((key) => element("kbd", { textContent: textOf(key) })),
            ),
            element("dd", { textContent: each.label }),
          ]),
        ),
      ),
    );
    this.dialog = element(
      "dialog",
      { className: "help" },
      { help: "" },
      element("header", {}, {}, title, close),
      // It scrolls: so that the arrow keys reach it
      element("div", { className: "groups", tabIndex: 0 }, {}, ...groups),
    );
    this.dialog.setAttribute("aria-labelledby", title.id);
    // The state goes first and the dialog follows: its own events come a little late.
    this.dialog.addEventListener("cancel", (event) => {
      event.preventDefault();
      onClose();
    });
    this.dialog.addEventListener("close", () => {
      if (!this.dialog.open) onClose(); // the browser may close it in spite of `cancel`
    });
    this.dialog.addEventListener("keydown", (event) => {
      // For a moment after it was closed the focus is still in it.
      if (event.key !== "?" || !this.dialog.open) return;
      event.preventDefault(); // or it would open again by the same key
      onClose();
    });
    parent.append(this.dialog);
  }

  update(isOpen: boolean): void {
    if (isOpen === this.dialog.open) return;
    if (isOpen) this.dialog.showModal();
    else this.dialog.close();
  }

  dispose(): void {
    this.dialog.remove();
  }
}
