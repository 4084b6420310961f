import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { fromHex } from "../math/color";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { DIALS, dialName } from "../state/path_trace_parameters";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import type { Wish } from "./controls";
import { told } from "./spoken_feedback";

const START = [
  { type: "choose-mode", mode: "traced" } as const,
  { type: "move-lamp", lamp: 1, change: { isOn: true } } as const,
].reduce<ViewerState>(reduce, initialState(sampleManifest(2)));
const after = (action: Action, before = START) =>
  told(action, before, reduce(before, action), new Map());

describe("what is told of the light", () => {
  it("names the part of a lamp that has changed", () => {
    const lamp = (change: Extract<Action, { type: "move-lamp" }>["change"]) =>
      after({ type: "move-lamp", lamp: 0, change });
    expect(lamp({ isOn: false })).toBe("Lamp 1: off");
    expect(lamp({ isOn: true })).toBe("Lamp 1: on");
    expect(lamp({ color: fromHex("#ff8000") })).toBe("Lamp 1: another colour");
    expect(lamp({ x: 1.25 })).toBe("Lamp 1, left to right: 1.25");
    expect(lamp({ strength: 2 })).toBe("Lamp 1, strength: 2 x");
  });

  it("says of a lamp that was dragged that it has moved, not where along one axis", () => {
    expect(after({ type: "move-lamp", lamp: 2, change: { x: 1, y: 0, z: -1 } })).toBe(
      "Lamp 3: moved",
    );
  });

  it("says whether there are lamps to be dragged", () => {
    const show = (areShown: boolean, before = START) =>
      after({ type: "show-lamps", areShown }, before);
    expect(show(true)).toBe("Lamps shown: drag them");
    expect(show(false)).toBe("Lamps hidden");
    const dark = [0, 1].reduce(
      (state, lamp) => reduce(state, { type: "move-lamp", lamp, change: { isOn: false } }),
      START,
    );
    expect(show(true, dark)).toBe("No lamp is on");
  });

  it("names every number of the light, and its value", () => {
    for (const dial of DIALS) {
      const [, high] = dial.limits;
      expect(after(dial.to(high)), dial.id).toBe(`${dialName(dial)}: ${dial.text(high)}`);
      const meant: Wish = { panel: "dial", dial: dial.id };
      const now = `${dialName(dial)}: ${dial.text(dial.of(START.trace))}`;
      expect(told(meant, START, START, new Map()), dial.id).toBe(now);
    }
  });

  it("tells of the room, of scatterings and of what comes after", () => {
    const trace = (change: Extract<Action, { type: "trace" }>["change"]) =>
      after({ type: "trace", change });
    expect(trace({ environment: "sky" })).toBe("Room: sky");
    expect(trace({ isMultiple: false })).toBe("Scattered once");
    expect(trace({ isMultiple: true })).toBe("Scattered many times");
    expect(trace({ isPostOn: false })).toBe("Before");
    expect(trace({ toneMap: "none" })).toBe("Tone map: none");
  });

  it("is nothing where the picture says it all", () => {
    expect(told("zoom-in", START, START, new Map())).toBe("");
  });
});
