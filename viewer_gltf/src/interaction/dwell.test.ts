import { describe, expect, it } from "vitest";
import {
  advanceDwell,
  DWELL_S,
  type Dwell,
  dwellProgress,
  NO_DWELL,
  type RaySample,
  RING_S,
  spend,
} from "./dwell";

const FRAME_S = 1 / 64; // exact in binary: 1.5 s is 96 frames
/** Degrees to the right of each target's middle. */
const MIDDLES: Readonly<Record<string, number>> = { a: 0, b: 2, far: 20 };

/** @param at_deg direction of the gaze, degrees to the right */
function seen(target: string | null, more: Partial<RaySample> = {}, at_deg?: number): RaySample {
  const angle = ((at_deg ?? (target === null ? 10 : MIDDLES[target])) * Math.PI) / 180;
  const direction = [Math.sin(angle), 0, -Math.cos(angle)] as const;
  const { layout = "" } = more;
  const own = { target, place: null, layout, layouts: [layout], direction, isGradual: false };
  return { ...own, ...more };
}

/** Looks at each sample for the given seconds. Returns the targets that fired, in order. */
function watch(
  gazes: readonly (readonly [RaySample | string | null, number])[],
  isOn = true,
  start = NO_DWELL,
) {
  let dwell: Dwell = start;
  const fired: (string | null)[] = [];
  const progress: number[] = [];
  for (const [at, seconds] of gazes) {
    const sample = at === null || typeof at === "string" ? seen(at) : at;
    // The frame in which a target is first seen starts its clock but adds no time.
    for (let i = 0; i <= Math.round(seconds / FRAME_S); i++) {
      const [next, fires] = advanceDwell(dwell, sample, FRAME_S, isOn);
      dwell = next;
      if (fires) fired.push(sample.target);
      progress.push(dwellProgress(dwell));
    }
  }
  return { fired, progress, dwell };
}

describe("a lasting gaze", () => {
  it("fires after 1.5 s and not one frame earlier", () => {
    expect(watch([["a", DWELL_S - FRAME_S]]).fired).toEqual([]);
    expect(watch([["a", DWELL_S]]).fired).toEqual(["a"]);
  });

  it("does not fire while it wanders over a large target, and fires once when it rests there", () => {
    const wander = Array.from({ length: 40 }, (_, i) => [seen("far", {}, 2.4 * i), 0.2] as const);
    expect(watch(wander).fired).toEqual([]);
    expect(watch([...wander, [seen("far", {}, 97), DWELL_S]]).fired).toEqual(["far"]);
    const tremble = Array.from(
      { length: 40 },
      (_, i) => [seen("far", {}, 2 * (i % 2)), 0.1] as const,
    );
    expect(watch(tremble).fired).toEqual(["far"]);
  });

  it("fires once even if it lasts longer, and again after leaving the target", () => {
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

  it("is cancelled by leaving, so two short gazes do not add up", () => {
    const gazes = [
      ["a", 1.4],
      ["b", 0.1],
      ["a", 1.4],
      [null, 0.1],
      ["a", 1.4],
    ] as const;
    expect(watch(gazes).fired).toEqual([]);
  });

  it("fills a ring evenly, and the ring disappears when it fires", () => {
    const { progress } = watch([["a", DWELL_S]]);
    expect(progress[0]).toBe(0);
    expect(progress[Math.floor(RING_S / FRAME_S)]).toBe(0); // a passing gaze shows no ring
    const middle = (48 * FRAME_S - RING_S) / (DWELL_S - RING_S);
    expect(progress[48]).toBeCloseTo(middle);
    expect(progress[95]).toBeGreaterThan(0.98);
    expect(progress[96]).toBe(0);
    expect(dwellProgress(NO_DWELL)).toBe(0);
  });

  it("never fires without a target", () => {
    expect(watch([[null, 5]]).fired).toEqual([]);
    expect(spend(NO_DWELL)).toEqual(NO_DWELL);
  });

  it("can be switched off, even half-way", () => {
    const { fired, progress } = watch([["a", 5]], false);
    expect(fired).toEqual([]);
    expect(Math.max(...progress)).toBe(0);
    const half = watch([["a", 1]]).dwell;
    const [off] = advanceDwell(half, seen("a"), FRAME_S, false);
    expect(dwellProgress(off)).toBe(0);
  });

  it("is not completed by a stall of the page", () => {
    const { dwell } = watch([["a", 0]]);
    expect(advanceDwell(dwell, seen("a"), 60)[1]).toBe(false);
  });
});

describe("a gaze that rests on the target that it has chosen", () => {
  it("chooses nothing else, even if it trembles across the border to the next control", () => {
    // from 0.4 degrees inside one control to 0.5 degrees inside the next one, and back
    const gazes = Array.from({ length: 8 }, (_, i) =>
      i % 2 === 0 ? ([seen("a", {}, 0.6), 2] as const) : ([seen("b", {}, 1.5), 2] as const),
    );
    expect(watch(gazes).fired).toEqual(["a"]);
  });

  it("chooses again a little further along a slider, but not on a switch", () => {
    const slider = { isGradual: true };
    const along = (more: Partial<RaySample>, by_deg: number) =>
      watch([
        [seen("a", more, 0), 2],
        [seen("a", more, by_deg), 2],
      ]).fired.length;
    expect([along(slider, 1.4), along(slider, 1.6)]).toEqual([1, 2]);
    expect([along({}, 1.6), along({}, 6)]).toEqual([1, 1]);
  });
});

describe("a layout change under the gaze", () => {
  const before = { layout: "before", place: "upper" };
  const after = { layout: "after", place: "upper" };

  it.each([
    ["another control moves there", seen("b", after, 0)],
    ["the control moves, and is still under the gaze", seen("a", { ...after, place: "lower" })],
  ])("prevents a choice until the gaze has moved: %s", (_, next) => {
    const { dwell } = watch([[seen("far", { ...before, place: "aside" }), 0]]);
    const arrived = watch([[seen("a", before), 1]], true, dwell);
    expect(dwellProgress(arrived.dwell)).toBeGreaterThan(0.5);
    const rested = watch([[next, 6]], true, arrived.dwell);
    expect(rested.fired).toEqual([]);
    const trembling = watch(
      [[{ ...next, direction: seen("a", {}, 0.9).direction }, 6]],
      true,
      rested.dwell,
    );
    expect(trembling.fired).toEqual([]);
    const moved = { ...next, direction: seen("a", {}, 1.6).direction };
    expect(watch([[moved, 6]], true, rested.dwell).fired).toEqual([next.target]);
  });

  it("does not stop the time if nothing changes under the gaze itself", () => {
    const { dwell } = watch([
      [seen("far", { ...before, place: "aside" }), 0],
      [seen("a", before), 1],
    ]);
    expect(watch([[seen("a", after), 1]], true, dwell).fired).toEqual(["a"]);
  });

  it("does not prevent a choice after the gaze itself moves to another control", () => {
    const { dwell } = watch([[seen("far", { ...before, place: "aside" }), 0]]);
    expect(watch([[seen("b", before), 2]], true, dwell).fired).toEqual(["b"]);
  });

  it("is assumed in the first frame for a control, but not for a tile", () => {
    expect(watch([[seen("a", before), 6]]).fired).toEqual([]);
    expect(watch([[seen("a", { ...before, place: null }), 6]]).fired).toEqual(["a"]);
  });

  it("does not let a control fire again when it comes back under the gaze", () => {
    const { dwell } = watch([[seen("far", { ...before, place: "aside" }), 0]]);
    const slid = seen("b", { layout: "then", place: "upper" }, 0);
    const gazes = [
      [seen("a", before), 2],
      [slid, 2],
      [seen("a", after), 6],
    ] as const;
    expect(watch(gazes, true, dwell).fired).toEqual(["a"]);
  });
});

describe("a button press", () => {
  it("spends the dwell, so the same target does not fire again", () => {
    const dwell = spend(watch([["a", 1]]).dwell);
    expect(watch([["a", 5]], true, dwell).fired).toEqual([]);
  });
});
