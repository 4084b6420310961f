/**
 * Makes one element for each control and updates it in place. A slider that is dragged and a field
 * that is typed in therefore keep the focus.
 */

import { element, setText } from "../../dom/element";
import type { Button, Choice, Control, Link, Search, Slider, Text, Toggle } from "../controls";
import { makeColour } from "./colour";
import { explainerOf, explainOptions, withExplainer, withNote } from "./explain";
import { makePicture } from "./picture";
import { makeWindow } from "./range";
import { makeMap } from "./tile_map";
import { makeHistogram } from "./transfer_function_2d";
import { hooks, requestOrRefusal, type Send, type Widget } from "./widget";

type Maker<C> = (first: C, send: Send) => Widget<C>;

const MAKERS: Readonly<{
  [K in Control["kind"]]: Maker<Extract<Control, { kind: K }>>;
}> = {
  toggle: makeToggle,
  slider: makeSlider,
  window: makeWindow,
  choice: makeChoice,
  colour: makeColour,
  button: makeButton,
  map: makeMap,
  histogram: makeHistogram,
  picture: makePicture,
  text: makeText,
  search: makeSearch,
  link: makeLink,
};

/** Makes the widget of a control. It may only be updated with a control of the same kind. */
export function makeWidget<C extends Control>(control: C, send: Send): Widget<C> {
  const widget = (MAKERS[control.kind] as unknown as Maker<C>)(control, send);
  widget.update(control);
  return widget;
}

const camel = (id: string) => id.replace(/-(.)/g, (_, letter: string) => letter.toUpperCase());

function makeToggle(first: Toggle, send: Send): Widget<Toggle> {
  let now = first;
  const input = element(
    "input",
    {
      type: "checkbox",
      className: "switch",
      role: "switch",
      ariaLabel: first.name ?? first.label,
      onchange: () => {
        const wanted = input.checked;
        input.checked = now.value; // the state decides whether the value changes
        send(requestOrRefusal(now, () => now.to(wanted)));
      },
    },
    hooks(first.id),
  );
  const label = element("span", { className: "label" });
  const root = element("label", { className: "toggle" }, {}, input, label);
  return {
    root: withExplainer(first, root),
    update(control) {
      now = control;
      input.checked = control.value;
      refuse(input, control.refusal);
      setText(label, control.label);
    },
  };
}

/**
 * Marks a refused control without disabling it, because it may be the one that was just used and
 * has the focus.
 */
function refuse(target: HTMLElement, refusal = ""): void {
  const isRefused = refusal !== "";
  if ((target.ariaDisabled === "true") === isRefused) return;
  target.ariaDisabled = isRefused ? "true" : null;
  target.title = refusal;
}

/** Reports the refusal of a disabled slider or list after a press, because a finger sees no tooltip. */
function explainRefusal(root: HTMLElement, now: () => Control, send: Send): void {
  root.addEventListener("click", () => {
    const { refusal } = now();
    if (refusal) send({ refusal });
  });
}

function makeSlider(first: Slider, send: Send): Widget<Slider> {
  let now = first;
  const explainer = explainerOf(first);
  const input = element(
    "input",
    {
      type: "range",
      min: "0",
      max: String(first.steps),
      step: "1",
      ariaLabel: first.name ?? first.label,
      oninput: () => send(now.to(Number(input.value) / now.steps)),
    },
    hooks(first.id),
  );
  const text = element("output", { ariaHidden: "true" }); // screen readers read the value from the input
  const head = element(
    "span",
    { className: "head" },
    {},
    element("span", {}, {}, first.label, ...(explainer === null ? [] : [explainer.button])),
    text,
  );
  const root = element("label", { className: "slider" }, {}, head, input);
  explainRefusal(root, () => now, send);
  return {
    root: withNote(root, explainer),
    update(control) {
      now = control;
      input.value = String(Math.round(control.value * control.steps));
      input.ariaValueText = control.text;
      input.disabled = Boolean(control.refusal);
      input.title = control.refusal ?? "";
      setText(text, control.text);
    },
  };
}

function makeChoice(first: Choice, send: Send): Widget<Choice> {
  return first.isInline ? makeSegments(first, send) : makeSelect(first, send);
}

function makeSegments(first: Choice, send: Send): Widget<Choice> {
  let now = first;
  const inputs = first.options.map(({ value }) =>
    element(
      "input",
      { type: "radio", name: first.id, value, onchange: () => send(now.to(value)) },
      { ...hooks(first.id), [camel(first.id)]: value },
    ),
  );
  const root = element(
    "div",
    { className: "segmented", role: "radiogroup", ariaLabel: first.name ?? first.label },
    {},
    ...first.options.map(({ label }, i) =>
      element("label", {}, {}, inputs[i], element("span", { textContent: label })),
    ),
  );
  return {
    root: named(first, root),
    update(control) {
      now = control;
      for (const input of inputs) input.checked = input.value === control.value;
    },
  };
}

/** Puts the label of a row of segments before it, if the label has an explanation. */
function named(first: Choice, segments: HTMLElement): HTMLElement {
  const explainer = explainerOf(first);
  if (explainer === null) return segments;
  const label = element("span", {
    className: "label",
    textContent: first.label,
    ariaHidden: "true",
  });
  const { button, note } = explainer;
  return element("div", { className: "explained" }, {}, label, button, segments, note);
}

function makeSelect(first: Choice, send: Send): Widget<Choice> {
  let now = first;
  const select = element(
    "select",
    {
      ariaLabel: first.name ?? first.label,
      onchange: () => send(now.to(select.value)),
    },
    { ...hooks(first.id), ...(first.id.includes("/") ? {} : { [camel(first.id)]: "" }) },
  );
  const label = element("span", { className: "label", textContent: first.label });
  const root = element("label", { className: "field" }, {}, label, select);
  explainRefusal(root, () => now, send);
  explainOptions(select, first);
  let listed = "";
  return {
    root: withExplainer(first, root),
    update(control) {
      now = control;
      const options = control.options.map((each) => `${each.value}\n${each.label}`).join("\n");
      if (options !== listed) {
        listed = options;
        select.replaceChildren(
          ...control.options.map((each) =>
            element("option", { value: each.value, textContent: each.label }),
          ),
        );
      }
      select.value = control.value;
      select.disabled = Boolean(control.refusal);
      select.title = control.refusal ?? "";
    },
  };
}

function makeButton(first: Button, send: Send): Widget<Button> {
  let now = first;
  const button = element(
    "button",
    {
      type: "button",
      className: first.isPrimary ? "primary" : "",
      onclick: () => send(requestOrRefusal(now, () => now.to())),
    },
    { ...hooks(first.id), action: first.id, ...(first.isStep ? { step: "" } : {}) },
  );
  const data = first.showsReason ? { [`${camel(first.id)}Reason`]: "" } : {};
  const reason = element("p", { className: "hint" }, data);
  return {
    root: first.showsReason
      ? element("div", { className: "with-reason" }, {}, button, reason)
      : button,
    update(control) {
      now = control;
      refuse(button, control.refusal);
      setText(button, control.label);
      setText(reason, control.refusal ?? "");
      reason.hidden = !control.refusal;
    },
  };
}

function makeText(first: Text): Widget<Text> {
  const value = element("span");
  const root = element(
    "p",
    { className: "fact" },
    hooks(first.id),
    element("span", { className: "label", textContent: first.label }),
    value,
  );
  return {
    root,
    update(control) {
      setText(value, control.value);
      root.hidden = control.value === "";
    },
  };
}

function makeSearch(first: Search, send: Send): Widget<Search> {
  let now = first;
  const input = element(
    "input",
    { type: "search", oninput: () => send(now.to(input.value)) },
    hooks(first.id),
  );
  const label = element("span", { className: "label" });
  return {
    root: element("label", { className: "search" }, {}, label, input),
    update(control) {
      now = control;
      setText(label, control.label);
      if (input.value !== control.value) input.value = control.value;
    },
  };
}

function makeLink(first: Link): Widget<Link> {
  const input = element(
    "input",
    { type: "text", readOnly: true, ariaLabel: first.label, onfocus: () => input.select() },
    hooks(first.id),
  );
  return {
    root: element("div", { className: "link" }, {}, input),
    update(control) {
      if (input.value !== control.value) input.value = control.value;
    },
  };
}
