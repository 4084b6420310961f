import { describe, expect, it } from "vitest";
import { cardWidth, perInchOf } from "./card_measure";

describe("a screen that is measured with a bank card", () => {
  it("has the pixels per inch that follow from the card's width of 53.98 mm", () => {
    expect(perInchOf(53.98)).toBeCloseTo(25.4, 1); // one pixel is about a millimetre
    expect(perInchOf(340)).toBeCloseTo(160, 0);
    expect(perInchOf(cardWidth(153.3))).toBeCloseTo(153.3, 0);
  });
});
