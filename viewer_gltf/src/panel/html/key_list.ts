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

/** Most keys that are listed without a search field. */
const MANY = 15;

/** The rows that a few letters leave, each a key's and its label's; all of them where nothing is sought. */
export function sought<T extends Readonly<{ text: string }>>(rows: readonly T[], words: string) {
  const parts = words.toLowerCase().split(/\s+/);
  return rows.filter(({ text }) => parts.every((part) => text.toLowerCase().includes(part)));
}

type Row = Readonly<{ text: string; elements: readonly HTMLElement[]; section: HTMLElement }>;

export class Help {
  private readonly dialog: HTMLDialogElement;
  private readonly rows: readonly Row[];
  private readonly find = element(
    "input",
    { type: "text", placeholder: "Find a key", ariaLabel: "Find a key", autocomplete: "off" },
    { control: "find-key" },
  );
  private readonly none = element("p", { textContent: "No key fits these words.", hidden: true });

  /** @param onClose called when the user wants it closed, at times once more than needed */
  constructor(parent: HTMLElement, onClose: () => void) {
    const close = element("button", {
      type: "button",
      textContent: "Close",
      onclick: onClose,
    });
    const title = element("h1", { id: "help-title", textContent: "Keys" });
    const groups = KEYS.map(({ name, keys }) => {
      const rows = keys.map((each) => {
        const shown = shownKeys(each.keys).map((key) =>
          element("kbd", { textContent: textOf(key) }),
        );
        const elements = [
          element("dt", {}, {}, ...shown),
          element("dd", { textContent: each.label }),
        ];
        return {
          text: `${name} ${elements.map(({ textContent }) => textContent).join(" ")}`,
          elements,
        };
      });
      const section = element(
        "section",
        {},
        {},
        element("h2", { textContent: name }),
        element("dl", {}, {}, ...rows.flatMap(({ elements }) => elements)),
      );
      return { section, rows: rows.map((row) => ({ ...row, section })) };
    });
    this.rows = groups.flatMap(({ rows }) => rows);
    this.find.hidden = this.rows.length <= MANY;
    this.find.addEventListener("input", () => this.show(this.find.value));
    this.dialog = element(
      "dialog",
      { className: "help" },
      { help: "" },
      element("header", {}, {}, title, this.find, close),
      // It scrolls: so that the arrow keys reach it
      element(
        "div",
        { className: "groups", tabIndex: 0 },
        {},
        ...groups.map(({ section }) => section),
        this.none,
      ),
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
      if (event.key !== "?" || this.find.value !== "") return;
      event.preventDefault(); // or it would open again by the same key
      onClose();
    });
    parent.append(this.dialog);
  }

  private show(words: string): void {
    const left = new Set(sought(this.rows, words.trim()));
    const sections = new Set([...left].map(({ section }) => section));
    for (const row of this.rows) {
      for (const each of row.elements) each.hidden = !left.has(row);
      row.section.hidden = !sections.has(row.section);
    }
    this.none.hidden = left.size > 0;
  }

  update(isOpen: boolean): void {
    if (isOpen === this.dialog.open) return;
    if (isOpen) {
      this.find.value = "";
      this.show("");
      this.dialog.showModal();
      this.find.focus();
      return;
    }
    this.dialog.close();
    // Until the next frame the focus may stay in the hidden field, which would swallow the keys.
    const { activeElement } = document;
    if (activeElement instanceof HTMLElement && this.dialog.contains(activeElement)) {
      activeElement.blur();
    }
  }

  dispose(): void {
    this.dialog.remove();
  }
}
