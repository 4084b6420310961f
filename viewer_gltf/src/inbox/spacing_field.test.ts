import { expect, it } from "vitest";
import { spacingText } from "./facts";
import { lengthOf } from "./spacing_field";

it.each([
  ["0.5", 0.5],
  [" 0,5 ", 0.5],
  ["1e2", 100],
  ["0", null],
  ["-1", null],
  ["", null],
  ["0.5 um", null],
])("a length typed as %o is %o", (text, length) => expect(lengthOf(text)).toBe(length));

it.each([
  [[0.25, 0.25, 1], "0.25 × 0.25 × 1 µm"],
  [[699.98, 666.66, 666.66], "0.7 × 0.667 × 0.667 mm"],
  [[1000, 1000, 5000], "1 × 1 × 5 mm"],
  [[], ""],
])("a spacing of %o um is shown as %s", (spacing_um, text) => {
  expect(spacingText(spacing_um)).toBe(text);
});
