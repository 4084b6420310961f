/** A control of a colour: any colour (the browser's picker), or one of the palettes. */

import { element } from "../../dom/element";
import { RovingTabindex } from "../../dom/roving_tabindex";
import type { Colour } from "../controls";
import { hooks, type Send, type Widget } from "./widget";

const SWATCHES_A_ROW = 4;

export function makeColour(first: Colour, send: Send): Widget<Colour> {
  return first.palettes.length === 0 ? makePicker(first, send) : makeSwatches(first, send);
}

function makePicker(first: Colour, send: Send): Widget<Colour> {
  let now = first;
  const input = element(
    "input",
    {
      type: "color",
      ariaLabel: first.name ?? first.label,
      oninput: () => send(now.to(input.value)),
    },
    hooks(first.id),
  );
  return {
    root: input,
    update(control) {
      now = control;
      if (input.value !== control.value) input.value = control.value;
      // Firefox does not draw the colour itself if a style sets an image, so a single colour is
      // drawn as a stripe, too
      const { shows = [], value } = control;
      input.style.setProperty("--shows", stripes(shows.length === 0 ? [value] : shows));
    },
  };
}

/** Returns a gradient with the colours side by side. */
function stripes(colors: readonly string[]): string {
  const share = 100 / colors.length;
  const stops = colors.map((color, i) => `${color} ${i * share}% ${(i + 1) * share}%`);
  return `linear-gradient(90deg,${stops})`;
}

function makeSwatches(first: Colour, send: Send): Widget<Colour> {
  let now = first;
  const buttons: HTMLButtonElement[] = [];
  const root = element("div", {
    className: "palettes",
    role: "group",
    ariaLabel: first.name ?? first.label,
  });
  for (const palette of first.palettes) {
    const row = palette.colors.map(({ name, hex }) => {
      const button = element(
        "button",
        {
          type: "button",
          className: "swatch",
          title: name,
          ariaLabel: `${palette.name}: ${name}`,
          onclick: () => send(now.to(hex)),
        },
        { ...hooks(first.id), color: hex },
      );
      button.style.setProperty("--color", hex);
      buttons.push(button);
      return button;
    });
    root.append(
      element("p", { className: "hint", textContent: palette.name }),
      element("div", { className: "swatches" }, {}, ...row),
    );
  }
  const tabindex = new RovingTabindex(root);
  tabindex.setButtons(buttons, SWATCHES_A_ROW);
  return {
    root,
    update(control) {
      now = control;
      for (const button of buttons) {
        button.ariaPressed = String(button.dataset.color === control.value);
      }
    },
  };
}
