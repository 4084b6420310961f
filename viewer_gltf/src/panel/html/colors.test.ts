/** The colours of both themes have the contrasts of WCAG 2.1 (1.4.3 and 1.4.11), level AA. */
import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";

const STYLE = readFileSync(new URL("./colors.css", import.meta.url), "utf8");

type Colors = Readonly<Record<string, string>>;

/** Returns the colours that a rule of the style sheet sets, by name. */
function colorsOf(selector: string): Colors {
  const start = STYLE.indexOf(`${selector} {`);
  expect(start, selector).toBeGreaterThanOrEqual(0);
  const rule = STYLE.slice(start, STYLE.indexOf("}", start));
  const found = [...rule.matchAll(/--([\w-]+): (#[0-9a-f]{3,6});/g)];
  return Object.fromEntries(found.map(([, name, hex]) => [name, hex]));
}

/** Relative luminance, 0..1. */
function luminance(hex: string): number {
  const digits =
    hex.length === 4 ? [...hex.slice(1)].map((digit) => digit + digit).join("") : hex.slice(1);
  const [r, g, b] = [0, 2, 4].map((i) => {
    const value = Number.parseInt(digits.slice(i, i + 2), 16) / 255;
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

function contrast(a: string, b: string): number {
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}

const DARK = colorsOf(":root");
const THEMES: Readonly<Record<string, Colors>> = {
  dark: DARK,
  light: { ...DARK, ...colorsOf('[data-theme="light"]') },
};
const TEXTS = ["text", "dim", "accent"];
const GROUNDS = ["back", "panel", "raised"];

describe.each(Object.entries(THEMES))("the %s page", (_, colors) => {
  it("has text with a contrast of 4.5 to 1 on every ground", () => {
    const pairs = TEXTS.flatMap((text) => GROUNDS.map((ground) => [text, ground]));
    for (const [text, ground] of [...pairs, ["on-accent", "accent"], ["text", "alarm"]]) {
      expect(contrast(colors[text], colors[ground]), `${text} on ${ground}`).toBeGreaterThan(4.5);
    }
  });

  it("has edges of controls with a contrast of 3 to 1", () => {
    for (const ground of GROUNDS) {
      expect(contrast(colors.edge, colors[ground]), `edge on ${ground}`).toBeGreaterThan(3);
    }
  });
});

it("sets every colour of the dark theme in the light theme", () => {
  expect(Object.keys(colorsOf('[data-theme="light"]'))).toEqual(Object.keys(DARK));
});
