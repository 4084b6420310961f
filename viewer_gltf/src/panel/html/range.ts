/** A slider with two ends: two range inputs on one track, each moved by its own thumb. */

import { element, setText } from "../../dom/element";
import type { Window } from "../controls";
import { explainerOf, withNote } from "./explain";
import { hooks, type Send, type Widget } from "./widget";

export function makeWindow(first: Window, send: Send): Widget<Window> {
  let now = first;
  const name = first.name ?? first.label;
  const explainer = explainerOf(first);
  const makeEnd = (end: 0 | 1) => {
    const input = element(
      "input",
      {
        type: "range",
        min: "0",
        max: String(first.steps),
        step: "1",
        ariaLabel: `${name}, ${end === 0 ? "lower" : "upper"} end`,
        oninput: () => {
          const value = Number(input.value) / now.steps;
          // an end cannot pass the other end
          if (end === 0) send(now.to([Math.min(value, now.value[1]), now.value[1]]));
          else send(now.to([now.value[0], Math.max(value, now.value[0])]));
          input.value = String(Math.round(now.value[end] * now.steps));
        },
      },
      hooks(`${first.id}-${end === 0 ? "low" : "high"}`),
    );
    return input;
  };
  const ends = [makeEnd(0), makeEnd(1)] as const;
  const text = element("output", { ariaHidden: "true" });
  const head = element(
    "span",
    { className: "head" },
    {},
    element("span", {}, {}, first.label, ...(explainer === null ? [] : [explainer.button])),
    text,
  );
  const bar = element("div", { className: "bar" });
  const track = element("div", { className: "ends" }, {}, bar, ...ends);
  const root = element(
    "div",
    { className: "window", role: "group", ariaLabel: name },
    {},
    head,
    track,
  );
  return {
    root: withNote(root, explainer),
    update(control) {
      now = control;
      const [low, high] = control.value;
      ends.forEach((input, i) => {
        input.value = String(Math.round(control.value[i] * control.steps));
        input.ariaValueText = control.texts[i];
      });
      track.style.setProperty("--low", String(low));
      track.style.setProperty("--high", String(high));
      // if both thumbs are in the upper half, the lower one is on top, so that it can still be
      // moved
      track.classList.toggle("at-the-end", low > 0.5);
      setText(text, `${control.texts[0]} – ${control.texts[1]}`);
    },
  };
}
