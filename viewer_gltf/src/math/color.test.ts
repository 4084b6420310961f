import { describe, expect, it } from "vitest";
import { fromHex, surfaceColor, toHex } from "./color";

describe("colours", () => {
  it("follow the sRGB curve", () => {
    expect(fromHex("#ff8000")[1]).toBeCloseTo(0.2158605, 6); // 128/255 by IEC 61966-2-1
    expect(toHex([1, 0.2158605, 0])).toBe("#ff8000");
  });

  it("are unchanged after conversion from hex and back", () => {
    for (const hex of ["#000000", "#010203", "#7f80fe", "#ffffff"])
      expect(toHex(fromHex(hex))).toBe(hex);
  });

  it("reject text that is not a colour", () => {
    expect(() => fromHex("red")).toThrow("colour is red, expected #rrggbb");
  });

  it("keep the artist's colour of a tile until the user recolours the channel", () => {
    const artist = [0.1, 0.2, 0.3] as const;
    const original = [1, 0, 0] as const;
    expect(surfaceColor(artist, original, [1, 0, 0])).toEqual(artist);
    expect(surfaceColor(artist, original, [0, 1, 0])).toEqual([0, 1, 0]);
  });
});
