import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Action } from "./actions";
import {
  isSameView,
  keyOfChange,
  MAX_STEPS,
  NO_HISTORY,
  nameOfChange,
  PAUSE_S,
  redone,
  undone,
  withoutUserChanges,
  withStep,
} from "./history";
import { initialState } from "./initial_state";
import { DISC_RADIUS } from "./parameters/volumes";
import { reduce } from "./reduce";

const START = initialState(sampleManifest(6));
const alone = { key: null, gesture: 0, isHeld: false, time_s: 0 };
const drag = { key: "set disc", gesture: 1, isHeld: true, time_s: 0 };

describe("a history", () => {
  it("goes back through every step and forward again", () => {
    let history = withStep<string>(NO_HISTORY, "a", "to b", alone);
    history = withStep(history, "b", "to c", alone);
    const once = undone(history, "c");
    expect([once?.moment, once?.name]).toEqual(["b", "to c"]);
    const twice = once && undone(once.history, "b");
    expect(twice?.moment).toBe("a");
    expect(twice && undone(twice.history, "a")).toBeNull();
    const again = twice && redone(twice.history, "a");
    expect([again?.moment, again?.name]).toEqual(["b", "to b"]);
    expect(again && redone(again.history, "b")?.moment).toBe("c");
  });

  it("forgets undone steps after another change", () => {
    const back = undone(withStep<string>(NO_HISTORY, "a", "to b", alone), "b");
    if (back === null) throw new Error("nothing to undo");
    expect(redone(withStep(back.history, "a", "to x", alone), "x")).toBeNull();
  });

  it("counts a drag as one step, however long it pauses, and the next drag as another", () => {
    let history = withStep<number>(NO_HISTORY, 0, "disc", drag);
    history = withStep(history, 1, "disc", { ...drag, time_s: 30 });
    expect(history.past).toHaveLength(1);
    history = withStep(history, 2, "disc", { ...drag, gesture: 3, time_s: 30.1 });
    expect(history.past.map(({ before }) => before)).toEqual([0, 2]);
  });

  it("counts keys in quick succession as one step, until a pause", () => {
    const key = { ...drag, isHeld: false };
    let history = withStep<number>(NO_HISTORY, 0, "disc", key);
    history = withStep(history, 1, "disc", { ...key, time_s: 0.9 * PAUSE_S });
    expect(history.past).toHaveLength(1);
    history = withStep(history, 2, "disc", { ...key, time_s: 2 * PAUSE_S });
    expect(history.past).toHaveLength(2);
    history = withStep(history, 3, "other", { ...key, key: "other", time_s: 2 * PAUSE_S });
    expect(history.past).toHaveLength(3);
  });

  it("is limited to the largest number of steps", () => {
    let history = withStep<number>(NO_HISTORY, 0, "x", alone);
    for (let i = 1; i < MAX_STEPS + 9; i++) history = withStep(history, i, "x", alone);
    expect(history.past).toHaveLength(MAX_STEPS);
  });
});

describe("a step", () => {
  const drags: readonly Action[] = [
    { type: "set", id: DISC_RADIUS.id, value: 9 },
    { type: "set", id: "opacity", channel: "c0", value: 0.5 },
    { type: "window", channel: "c0", window: [0.1, 0.9] },
    { type: "set-clip", clip: { box: null, plane: { normal: [0, 0, 1], offset_um: 1 } } },
  ];
  const presses: readonly Action[] = [
    { type: "set", id: "mode", value: "all" },
    { type: "show", channel: "c0", shown: false },
    { type: "isolate", tile: "r0_c1" },
  ];

  it("is a visible change with a name", () => {
    for (const action of [...drags, ...presses]) {
      expect(isSameView(START, reduce(START, action)), action.type).toBe(false);
      expect(nameOfChange(action, START)).not.toBe("");
    }
    expect(drags.map(keyOfChange)).not.toContain(null);
    expect(new Set(presses.map(keyOfChange))).toEqual(new Set([null]));
  });

  it("is neither a notice nor fetched data", () => {
    const notified = reduce(START, { type: "notify", text: "a fault" });
    expect(isSameView(START, notified)).toBe(true);
    const transfer2d = { gradient_max: 0.4, functions: {} };
    const fetched = reduce(notified, { type: "learn-transfer-2d", channel: "c0", transfer2d });
    expect(isSameView(START, fetched)).toBe(true);
    const changed = reduce(fetched, { type: "set", id: DISC_RADIUS.id, value: 9 });
    const back = withoutUserChanges(START, changed);
    expect(back.notices).toEqual(["a fault"]);
    expect(back.channels[0].transfer2d).toBe(transfer2d);
    expect(back.discRadius_deg).toBe(START.discRadius_deg);
    expect(isSameView(back, fetched)).toBe(true);
  });
});
