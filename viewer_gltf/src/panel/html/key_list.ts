/**
 * The list of all keys, in a dialog that keeps the focus until it is closed. Each key is a button.
 * After a click on it, the next key that is pressed takes over its function.
 */
import "./key_list.css";
import { element, setText } from "../../dom/element";
import { RovingTabindex } from "../../dom/roving_tabindex";
import type { Key } from "../key";
import { changeKey, FIXED, keyNow } from "../key_changes";
import { keyName } from "../key_events";
import type { KeyChanges, KeyTable } from "../keys";

const NAMES: Readonly<Record<string, string>> = {
  ArrowLeft: "←",
  ArrowRight: "→",
  ArrowUp: "↑",
  ArrowDown: "↓",
  Escape: "Esc",
  Delete: "Del",
  Backspace: "⌫",
};

/** Returns the text of a key, with Shift if it belongs to the key. */
function textOf(key: string): string {
  const [, control, letter] = /^(Ctrl\+)(.)$/.exec(key) ?? [];
  if (control !== undefined) {
    const capital = letter.toUpperCase();
    return letter === capital ? `Ctrl ⇧ ${capital}` : `Ctrl ${capital}`;
  }
  const [, shift = "", name = key] = /^(Shift\+)(.+)$/.exec(key) ?? [];
  return `${shift && "⇧ "}${NAMES[name] ?? name}`;
}

/** Returns the rows that contain all words of a text; an empty text keeps all rows. */
export function filterRows<T extends Readonly<{ text: string }>>(
  rows: readonly T[],
  words: string,
) {
  const parts = words.toLowerCase().split(/\s+/);
  return rows.filter(({ text }) => parts.every((part) => text.toLowerCase().includes(part)));
}

const HOW = "Press a key of this list to change it.";
const WAITING = "press …";
/** Modifier keys, which are held while another key is pressed. */
const MODIFIERS = ["Shift", "Control", "Alt", "AltGraph", "Meta", "CapsLock", "Dead", "Process"];

/** One key of the list, by its name in the tables. */
type KeyCap = Readonly<{ name: string; root: HTMLElement }>;
type Row = Readonly<{
  group: string;
  label: string;
  caps: readonly KeyCap[];
  elements: readonly HTMLElement[];
  section: HTMLElement;
}>;

export class Help {
  private readonly dialog: HTMLDialogElement;
  private readonly rows: readonly Row[];
  private readonly find = element(
    "input",
    { type: "text", placeholder: "Find a key", ariaLabel: "Find a key", autocomplete: "off" },
    { control: "find-key" },
  );
  private readonly none = element("p", { textContent: "No key matches this text.", hidden: true });
  private readonly line = element("p", { className: "hint", role: "status" }, { keyLine: "" });
  private readonly reset = element(
    "button",
    { type: "button", textContent: "Reset all keys", onclick: () => this.resetAll() },
    { action: "reset-keys" },
  );
  private changes: KeyChanges = {};
  /** All keys are one stop of the Tab key. Otherwise it would take a hundred presses to pass them. */
  private readonly tabindex: RovingTabindex;
  /** The key that the next press changes, by its name in the tables; null: none. */
  private asked: string | null = null;

  /** @param onClose called when the user closes the dialog, sometimes twice */
  constructor(
    parent: HTMLElement,
    private readonly table: KeyTable,
    private readonly onClose: () => void,
    private readonly onChange: (changes: KeyChanges) => void,
  ) {
    const sections = table.groups.map(({ name, keys }) => this.sectionOf(name, keys));
    this.rows = sections.flatMap(({ rows }) => rows);
    this.find.addEventListener("input", () => this.show(this.find.value));
    const title = element("h1", { id: "help-title", textContent: "Keys" });
    const close = element("button", { type: "button", textContent: "Close", onclick: onClose });
    const groups = element(
      "div",
      { className: "groups" },
      {},
      ...sections.map(({ section }) => section),
      this.none,
    );
    this.dialog = element(
      "dialog",
      { className: "help" },
      { help: "" },
      element("header", {}, {}, title, this.find, this.reset, close, this.line),
      groups,
    );
    this.tabindex = new RovingTabindex(groups);
    this.dialog.setAttribute("aria-labelledby", title.id);
    this.listen();
    parent.append(this.dialog);
  }

  private listen(): void {
    // The state changes first and the dialog follows it, because the dialog's events come slightly
    // late.
    this.dialog.addEventListener("cancel", (event) => {
      event.preventDefault();
      if (this.asked === null) this.onClose();
      else this.ask(null);
    });
    this.dialog.addEventListener("close", () => {
      if (!this.dialog.open) this.onClose(); // the browser may close the dialog in spite of `cancel`
    });
    const onKey = (event: KeyboardEvent) => {
      if (this.asked !== null) this.take(event, this.asked);
      else if (event.key === FIXED && this.find.value === "") {
        event.preventDefault(); // otherwise the same key would open the list again
        this.onClose();
      }
    };
    this.dialog.addEventListener("keydown", onKey, { capture: true });
  }

  private sectionOf(name: string, keys: readonly Key[]) {
    const section = element("section", {}, {}, element("h2", { textContent: name }));
    const rows = keys.map((each): Row => {
      const caps = each.keys.map((key) => ({ name: key, root: this.capOf(key) }));
      const elements = [
        element("dt", {}, {}, ...caps.map(({ root }) => root)),
        element("dd", { textContent: each.label }),
      ];
      return { group: name, label: each.label, caps, elements, section };
    });
    section.append(element("dl", {}, {}, ...rows.flatMap(({ elements }) => elements)));
    return { section, rows };
  }

  private capOf(name: string): HTMLElement {
    if (name === FIXED) return element("kbd", { textContent: name });
    return element(
      "button",
      { type: "button", className: "cap", onclick: () => this.ask(name) },
      { key: name },
    );
  }

  /** Lets the next key that is pressed replace this one; null: none. */
  private ask(name: string | null, words = ""): void {
    this.asked = name;
    const press =
      name === null
        ? HOW
        : `Press the new key for “${this.table.labelOf(name)}”, or Esc to cancel.`;
    this.write();
    setText(this.line, words || press);
  }

  private take(event: KeyboardEvent, asked: string): void {
    if (MODIFIERS.includes(event.key) || event.isComposing) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key === "Escape") {
      this.ask(null);
      return;
    }
    const answer = changeKey(this.table, this.changes, asked, keyName(event));
    if ("refusal" in answer) {
      setText(this.line, answer.refusal);
      return;
    }
    this.changes = answer.changes;
    this.ask(
      null,
      `${textOf(keyNow(asked, this.changes))} now does “${this.table.labelOf(asked)}”.`,
    );
    this.onChange(this.changes);
  }

  private resetAll(): void {
    this.changes = {};
    this.ask(null, "All keys are reset.");
    this.onChange(this.changes);
  }

  /** Writes into each row of the list the key that now has the row's function. */
  private write(): void {
    for (const { label, caps } of this.rows) {
      for (const { name, root } of caps) {
        if (name === FIXED) continue;
        const text = textOf(keyNow(name, this.changes));
        const isAsked = name === this.asked;
        setText(root, isAsked ? WAITING : text);
        root.ariaLabel = `${isAsked ? WAITING : text}, key for: ${label}`;
        root.classList.toggle("changed", name in this.changes);
      }
    }
    this.reset.hidden = Object.keys(this.changes).length === 0;
  }

  private show(words: string): void {
    const rows = this.rows.map((row) => {
      const keys = row.caps.map(({ name }) => textOf(keyNow(name, this.changes))).join(" ");
      return { row, text: `${row.group} ${keys} ${row.label}` };
    });
    const left = new Set(filterRows(rows, words.trim()).map(({ row }) => row));
    const sections = new Set([...left].map(({ section }) => section));
    for (const row of this.rows) {
      for (const each of row.elements) each.hidden = !left.has(row);
      row.section.hidden = !sections.has(row.section);
    }
    this.none.hidden = left.size > 0;
    const caps = [...left].flatMap((row) => row.caps.map(({ root }) => root));
    this.tabindex.setButtons(
      caps.filter((root) => root instanceof HTMLButtonElement),
      1,
    );
  }

  update(isOpen: boolean, changes: KeyChanges): void {
    this.changes = changes;
    if (isOpen === this.dialog.open) return;
    if (isOpen) {
      this.find.value = "";
      this.show("");
      this.ask(null);
      this.dialog.showModal();
      this.find.focus();
      return;
    }
    this.dialog.close();
    // Until the next frame the hidden field may keep the focus and swallow keys.
    const { activeElement } = document;
    if (activeElement instanceof HTMLElement && this.dialog.contains(activeElement)) {
      activeElement.blur();
    }
  }

  dispose(): void {
    this.dialog.remove();
  }
}
