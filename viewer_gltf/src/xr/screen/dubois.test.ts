import { expect, it } from "vitest";
import { colorDifference, toLab } from "../../../test/support/color_difference";
import { fromHex, type Rgb, toHex } from "../../math/color";
import { LEFT, type Projection, RIGHT } from "./dubois";

const times = (projection: Projection, color: Rgb) =>
  projection.map((row) => row.reduce((sum, k, i) => sum + k * color[i], 0)) as unknown as Rgb;
const sum = (a: Rgb, b: Rgb) => a.map((v, i) => v + b[i]) as unknown as Rgb;
const pixel = (hex: string) =>
  [1, 3, 5].map((i) => Number.parseInt(hex.slice(i, i + 2), 16)) as unknown as Rgb;

it.each(["#000000", "#404040", "#808080", "#c0c0c0", "#ffffff"])(
  "shows the grey %s unchanged if both eyes see it",
  (hex) => {
    const grey = fromHex(hex);
    const shown = toHex(sum(times(LEFT, grey), times(RIGHT, grey)));
    expect(colorDifference(toLab(pixel(shown)), toLab(pixel(hex)))).toBeLessThan(1);
  },
);

it("an anaglyph gives the left eye's light to red, and the right eye's to green and blue", () => {
  const [red, ...cyan] = times(LEFT, [1, 1, 1]);
  expect(red).toBeGreaterThan(1);
  expect(Math.max(...cyan)).toBeLessThan(0);
  const [ghost, green, blue] = times(RIGHT, [1, 1, 1]);
  expect(ghost).toBeLessThan(0);
  expect(Math.min(green, blue)).toBeGreaterThan(1);
});
