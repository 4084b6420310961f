import { describe, expect, it } from "vitest";
import { cardWidth, perInchOf } from "./card_measure";

describe("a screen that is measured by a bank card", () => {
  it("has as many pixels in an inch as the card's 53.98 mm say", () => {
    expect(perInchOf(53.98)).toBeCloseTo(25.4, 1); // a pixel is a millimetre
    expect(perInchOf(340)).toBeCloseTo(160, 0);
    expect(perInchOf(cardWidth(153.3))).toBeCloseTo(153.3, 0);
  });
});
