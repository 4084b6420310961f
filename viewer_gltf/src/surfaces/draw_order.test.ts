import { describe, expect, it } from "vitest";
import type { Vec3 } from "../math/vec3";
import { turnsOf } from "./draw_order";

const box = (low: Vec3, high: Vec3): readonly Vec3[] => [low, high];

describe("the order of translucent channels", () => {
  it("draws a channel inside another one first", () => {
    const outer = box([0, 0, 0], [10, 10, 10]);
    const inner = box([4, 4, 4], [6, 6, 6]);
    for (const eye of [
      [5, 5, 50],
      [-50, 5, 5],
      [40, 40, 40],
    ] as Vec3[]) {
      expect(turnsOf(eye, [outer, inner])).toEqual([1, 0]);
      expect(turnsOf(eye, [inner, outer])).toEqual([0, 1]);
    }
  });

  it("draws the nearer of two separate channels last", () => {
    const [left, right] = [box([0, 0, 0], [1, 1, 1]), box([5, 0, 0], [6, 1, 1])];
    expect(turnsOf([-9, 0, 0], [left, right])).toEqual([1, 0]);
    expect(turnsOf([20, 0, 0], [left, right])).toEqual([0, 1]);
  });

  it("draws the first channel last if all begin at the same distance", () => {
    const same = box([0, 0, 0], [1, 1, 1]);
    expect(turnsOf([0, 0, 9], [same, same, same])).toEqual([2, 1, 0]);
  });
});
