import { describe, expect, it } from "vitest";
import { toHex } from "../math/color";
import { PALETTES } from "../state/objects";
import { byteOf, byteValue, colorAt, tableOf } from "./palettes";
import { sampleContent } from "./sample_table";

const [NUMBER, CATEGORY] = sampleContent().columns;
const VIEW = { palette: "viridis", span: [1, 255], isLog: null } as const;
const at = (table: Uint8Array, byte: number) => [...table.subarray(4 * byte, 4 * byte + 3)];

/** Lightness L* (CIE 1976) of a linear colour. */
function lightness([r, g, b]: readonly [number, number, number]): number {
  const y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
  return y > 0.008856 ? 116 * Math.cbrt(y) - 16 : 903.3 * y;
}

describe("palettes", () => {
  it("become lighter from end to end, so that they can be read without hues", () => {
    for (const name of PALETTES.filter((each) => each !== "diverging")) {
      const steps = Array.from({ length: 33 }, (_, i) => lightness(colorAt(name, i / 32)));
      for (let i = 1; i < 33; i++) expect(steps[i], `${name} ${i}`).toBeGreaterThan(steps[i - 1]);
    }
  });

  it("that have two hues are lightest in the middle", () => {
    const [low, middle, high] = [0, 0.5, 1].map((at) => lightness(colorAt("diverging", at)));
    expect(middle).toBeGreaterThan(low + 40);
    expect(middle).toBeGreaterThan(high + 40);
  });

  it("begin and end with their published colours", () => {
    expect([-1, 0, 1, 2].map((share) => toHex(colorAt("viridis", share)))).toEqual([
      ...["#440154", "#440154", "#fde725", "#fde725"],
    ]);
  });
});

describe("a column's table of colours", () => {
  it("has grey for missing values, and spreads the palette over the span", () => {
    const table = tableOf(NUMBER, { ...VIEW, span: [65, 129] });
    expect(at(table, 0)).toEqual([101, 101, 105]);
    expect(at(table, 1)).toEqual([0x44, 0x01, 0x54]);
    expect(at(table, 65)).toEqual([0x44, 0x01, 0x54]);
    expect(at(table, 129)).toEqual([0xfd, 0xe7, 0x25]);
    expect(at(table, 255)).toEqual([0xfd, 0xe7, 0x25]);
  });

  it("spreads the palette over the values or over their logarithm", () => {
    // byte 128 is the logarithmic middle of 1 to 100, 10, which lies at 1/11 of the linear range
    expect(at(tableOf(NUMBER, VIEW), 128).join()).toBe(
      at(tableOf(NUMBER, { ...VIEW, isLog: true }), 128).join(),
    );
    const linear = at(tableOf(NUMBER, { ...VIEW, isLog: false }), 128);
    const expected = Number.parseInt(toHex(colorAt("viridis", 9 / 99)).slice(1, 3), 16);
    expect(Math.abs(linear[0] - expected)).toBeLessThanOrEqual(1);
  });

  it("has the stated colours of categories, or distinct colours if none are stated", () => {
    expect(at(tableOf(CATEGORY, VIEW), 1)).toEqual([255, 0, 0]);
    expect(at(tableOf(CATEGORY, VIEW), 2)).toEqual([0, 0, 255]);
    const { colors: _, ...plain } = CATEGORY;
    expect(at(tableOf(plain, VIEW), 1)).toEqual([0xe6, 0x9f, 0x00]);
  });
});

it("converts a byte to its value and back", () => {
  const { range } = NUMBER;
  if (range === undefined) throw new Error("the sample has a range");
  expect([1, 128, 255].map((byte) => Number(byteValue(range, byte).toFixed(6)))).toEqual([
    1, 10, 100,
  ]);
  for (const byte of [1, 7, 128, 255]) expect(byteOf(range, byteValue(range, byte))).toBe(byte);
  expect(byteOf({ ...range, scale: "linear" }, 50.5)).toBe(128);
  expect([0, 1e9].map((value) => byteOf(range, value))).toEqual([1, 255]);
});
