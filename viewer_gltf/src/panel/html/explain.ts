/** A question mark beside a control's label, which opens the explanation below it. */
import { element } from "../../dom/element";
import type { Control } from "../controls";

const load = () => import("../explanations");

export type Explainer = Readonly<{ button: HTMLElement; note: HTMLElement }>;

/** Returns the question mark and the note of a control; null: it needs no explanation. */
export function explainerOf(control: Control): Explainer | null {
  const { id, label, name = label, about } = control;
  if (about === undefined) return null;
  const note = element("div", { className: "explanation", role: "note", hidden: true });
  const button = element(
    "button",
    { type: "button", className: "explain", textContent: "?", ariaLabel: `About: ${name}` },
    { explain: id },
  );
  button.ariaExpanded = "false";
  button.addEventListener("click", async (event) => {
    event.preventDefault(); // otherwise the label around the button would also operate the control
    const isOpen = button.ariaExpanded === "true";
    button.ariaExpanded = String(!isOpen);
    if (note.childElementCount === 0) note.replaceChildren(...(await linesOf(control, about)));
    note.hidden = isOpen;
  });
  return { button, note };
}

async function linesOf(control: Control, about: string): Promise<readonly HTMLElement[]> {
  const lines = [element("p", { textContent: about })];
  if (control.kind !== "choice") return lines;
  const { explanationOfChoice } = await load();
  for (const { value, label } of control.options) {
    const text = explanationOfChoice(control.id, value);
    if (text === "") continue;
    lines.push(element("p", {}, {}, element("b", { textContent: label }), ` ${text}`));
  }
  return lines;
}

/** Gives each option of a list a tooltip once the pointer or the focus reaches the list. */
export function explainOptions(select: HTMLSelectElement, { id, about }: Control): void {
  if (about === undefined) return;
  const explain = async () => {
    const { explanationOfChoice } = await load();
    for (const option of select.options) option.title = explanationOfChoice(id, option.value);
  };
  for (const kind of ["pointerenter", "focus"]) select.addEventListener(kind, () => void explain());
}

/**
 * Returns a control with its question mark in the same row and the note below; the control alone if
 * it has no explanation.
 */
export function withExplainer(control: Control, root: HTMLElement): HTMLElement {
  const explainer = explainerOf(control);
  if (explainer === null) return root;
  return element("div", { className: "explained" }, {}, root, explainer.button, explainer.note);
}

/** Returns a control with the note below; its label already has the question mark. */
export function withNote(root: HTMLElement, explainer: Explainer | null): HTMLElement {
  if (explainer === null) return root;
  return element("div", { className: "explained" }, {}, root, explainer.note);
}
