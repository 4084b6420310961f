import { describe, expect, it } from "vitest";
import { DOUBLE_MS, isSecondPress, type TimedPress } from "./double_press";
import type { RaySample } from "./dwell";

const SAMPLE: RaySample = {
  target: "a",
  place: "upper",
  layout: "before",
  layouts: ["before"],
  direction: [0, 0, -1],
  isGradual: false,
};
/** @param right_deg direction of the ray, degrees to the right */
function pressed(
  time_ms: number,
  more: Partial<RaySample> = {},
  isStep = false,
  right_deg = 0,
): TimedPress {
  const angle = (right_deg * Math.PI) / 180;
  const direction = [Math.sin(angle), 0, -Math.cos(angle)] as const;
  return { time_ms, sample: { ...SAMPLE, direction, ...more }, isStep };
}

describe("the second of two quick presses", () => {
  const first = pressed(1000);

  it("is ignored on the same control", () => {
    expect(isSecondPress(first, pressed(1150))).toBe(true);
    // Pressing a trigger shakes the hand.
    expect(isSecondPress(first, pressed(1150, {}, false, 3))).toBe(true);
  });

  it("counts if the first press was long ago or there was none", () => {
    expect(isSecondPress(first, pressed(1001 + DOUBLE_MS))).toBe(false);
    expect(isSecondPress(null, pressed(1000))).toBe(false);
  });

  it("counts on a control that advances by steps", () => {
    expect(isSecondPress(pressed(1000, {}, true), pressed(1150, {}, true))).toBe(false);
  });

  it("is ignored on a control that has moved under the ray meanwhile, even one with steps", () => {
    const other = { target: "b", layout: "after", layouts: ["after"] };
    expect(isSecondPress(first, pressed(1150, other))).toBe(true);
    expect(isSecondPress(first, pressed(1150, other, true))).toBe(true);
    expect(
      isSecondPress(first, pressed(1150, { place: "lower", layout: "after", layouts: ["after"] })),
    ).toBe(true);
  });

  it("counts on another control to which the ray has moved", () => {
    expect(isSecondPress(first, pressed(1150, { target: "b", place: "lower" }, false, 2))).toBe(
      false,
    );
    const other = { target: "b", place: "lower", layout: "after", layouts: ["after"] };
    expect(isSecondPress(first, pressed(1150, other, false, 5))).toBe(false);
  });
});
