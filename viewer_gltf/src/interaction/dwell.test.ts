import { describe, expect, it } from "vitest";
import { advanceDwell, DWELL_S, type Dwell, dwellProgress, fire, NO_DWELL } from "./dwell";

const FRAME_S = 1 / 64; // exact in binary: 1.5 s is 96 frames

/** Look at each target for so many seconds; the targets that fired, in order. */
function watch(gazes: readonly (readonly [string | null, number])[], isOn = true) {
  let dwell: Dwell = NO_DWELL;
  const fired: (string | null)[] = [];
  const progress: number[] = [];
  for (const [target, seconds] of gazes) {
    // The frame on which a target is first seen starts its clock and adds nothing to it.
    for (let i = 0; i <= Math.round(seconds / FRAME_S); i++) {
      const [next, fires] = advanceDwell(dwell, target, FRAME_S, isOn);
      dwell = next;
      if (fires) fired.push(target);
      progress.push(dwellProgress(dwell));
    }
  }
  return { fired, progress, dwell };
}

describe("gaze that lasts", () => {
  it("fires after 1.5 s and not a frame earlier", () => {
    expect(watch([["a", DWELL_S - FRAME_S]]).fired).toEqual([]);
    expect(watch([["a", DWELL_S]]).fired).toEqual(["a"]);
  });

  it("fires once, however long it lasts, and again after the target was left", () => {
    expect(watch([["a", 10]]).fired).toEqual(["a"]);
    const gazes = [
      ["a", 3],
      [null, 0.1],
      ["a", 3],
      ["b", 2],
      ["a", 3],
    ] as const;
    expect(watch(gazes).fired).toEqual(["a", "a", "b", "a"]);
  });

  it("is cancelled by leaving: two short gazes do not add up", () => {
    const gazes = [
      ["a", 1.4],
      ["b", 0.1],
      ["a", 1.4],
      [null, 0.1],
      ["a", 1.4],
    ] as const;
    expect(watch(gazes).fired).toEqual([]);
  });

  it("fills a ring evenly, which vanishes when it fires", () => {
    const { progress } = watch([["a", DWELL_S]]);
    expect(progress[0]).toBe(0);
    expect(progress[48]).toBe(0.5);
    expect(progress[95]).toBeCloseTo(95 / 96);
    expect(progress[96]).toBe(0);
    expect(dwellProgress(NO_DWELL)).toBe(0);
  });

  it("fires at nothing never", () => {
    expect(watch([[null, 5]]).fired).toEqual([]);
    expect(fire(NO_DWELL)).toEqual([NO_DWELL, false]);
  });

  it("can be turned off, also half-way", () => {
    const { fired, progress } = watch([["a", 5]], false);
    expect(fired).toEqual([]);
    expect(Math.max(...progress)).toBe(0);
    const half = watch([["a", 1]]).dwell;
    const [off] = advanceDwell(half, "a", FRAME_S, false);
    expect(dwellProgress(off)).toBe(0);
  });

  it("is not made by a stall of the page", () => {
    const { dwell } = watch([["a", 0]]);
    expect(advanceDwell(dwell, "a", 60)[1]).toBe(false);
  });
});

describe("the button", () => {
  it("fires at once, every time, also where dwell is off", () => {
    const { dwell } = watch([["a", 0]], false);
    const [once, first] = fire(dwell);
    const [, second] = fire(once);
    expect([first, second]).toEqual([true, true]);
  });

  it("takes the dwell's turn: the same target does not fire late as well", () => {
    let [dwell] = fire(watch([["a", 1]]).dwell);
    let fired = 0;
    for (let i = 0; i < 300; i++) {
      const [next, fires] = advanceDwell(dwell, "a", FRAME_S);
      dwell = next;
      fired += fires ? 1 : 0;
    }
    expect(fired).toBe(0);
  });
});
