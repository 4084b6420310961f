import { describe, expect, it } from "vitest";
import { distanceText, sizeText } from "./length_text";

describe("a distance", () => {
  it("is written with three digits in the unit that gives the shortest text", () => {
    const texts = [0, 0.0123, 0.4567, 0.9996, 1, 9.996, 12.34, 123.4, 999.4, 999.9, 12345, 1.5e6];
    expect(texts.map(distanceText)).toEqual([
      "0 µm",
      "12.3 nm",
      "457 nm",
      "1.00 µm",
      "1.00 µm",
      "10.0 µm",
      "12.3 µm",
      "123 µm",
      "999 µm",
      "1.00 mm",
      "12.3 mm",
      "1500 mm",
    ]);
  });
});

describe("a size", () => {
  it("is in the unit of its longest edge", () => {
    expect(sizeText([231_000, 215_000, 255_000])).toBe("231 × 215 × 255 mm");
    expect(sizeText([67.06, 26.74, 13.16])).toBe("67.1 × 26.7 × 13.2 µm");
    expect(sizeText([1200, 90, 4.5])).toBe("1.2 × 0.09 × 0.0045 mm");
    expect(sizeText([0.5, 0, 0.25])).toBe("500 × 0 × 250 nm");
  });
});
