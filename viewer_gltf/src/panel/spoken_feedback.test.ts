import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { setTo } from "../state/parameters/kinds";
import { LAMP, LIGHT_NUMBERS } from "../state/parameters/light";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import type { Request } from "./controls";
import { spokenFeedback } from "./spoken_feedback";

const START = [
  { type: "set", id: "mode", value: "traced" } as const,
  setTo(LAMP[1].isOn, true),
].reduce<ViewerState>(reduce, initialState(sampleManifest(2)));
const after = (action: Action, before = START) =>
  spokenFeedback(action, before, reduce(before, action), new Map());

describe("announcements of the light", () => {
  it("name the part of a lamp that has changed", () => {
    const { isOn, color, place, numbers } = LAMP[0];
    expect(after(setTo(isOn, false))).toBe("Lamp 1: off");
    expect(after(setTo(isOn, true))).toBe("Lamp 1: on");
    expect(after(setTo(color, [1, 0.5, 0]))).toBe("Lamp 1: new colour");
    expect(after(setTo(place[0], 1.25))).toBe("Lamp 1, left to right: 1.25");
    expect(after(setTo(numbers[3], 2))).toBe("Lamp 1, strength: 2 x");
  });

  it("report only that a dragged lamp has moved", () => {
    expect(after({ type: "move-lamp", lamp: 2, place: [1, 0, -1] })).toBe("Lamp 3: moved");
  });

  it("report whether there are lamps to drag", () => {
    const show = (areShown: boolean, before = START) =>
      after({ type: "set", id: "trace/lamps", value: areShown }, before);
    expect(show(true)).toBe("Lamps shown: drag them");
    expect(show(false)).toBe("Lamps hidden");
    const dark = [0, 1].reduce(
      (state, lamp) => reduce(state, setTo(LAMP[lamp].isOn, false)),
      START,
    );
    expect(show(true, dark)).toBe("No lamp is on");
  });

  it("name every number of the light, and its value", () => {
    const names = new Set<string>();
    for (const row of LIGHT_NUMBERS) {
      const [, high] = row.limits;
      const announced = after(setTo(row, high));
      expect(announced).toContain(row.text(high));
      expect(announced.toLowerCase()).toContain(row.label.toLowerCase());
      names.add(announced.slice(0, announced.indexOf(":")));
      const choice: Request = { panel: "parameter", parameter: row.id };
      expect(spokenFeedback(choice, START, START, new Map()), row.id).toBe(row.spoken(START));
    }
    expect(names.size).toBe(LIGHT_NUMBERS.length);
  });

  it("report the environment, scattering and image adjustments", () => {
    const set = (id: string, value: string | boolean) => after({ type: "set", id, value });
    expect(set("trace-room", "sky")).toBe("Environment: sky");
    expect(set("trace/multiple", false)).toBe("Multiple scattering: off");
    expect(set("trace/multiple", true)).toBe("Multiple scattering: on");
    expect(set("trace/post", false)).toBe("Image adjustments: off");
    expect(set("trace-tone-map", "none")).toBe("Tone map: none");
  });

  it("name the new value of a parameter of the view or of a channel", () => {
    const set = (id: string, value: string | number | boolean, channel?: string) =>
      after(
        channel === undefined ? { type: "set", id, value } : { type: "set", id, value, channel },
      );
    expect(set("mode", "off")).toBe("Surfaces only");
    expect(set("switch-distance", 2.5)).toBe("Volumes within 2.5 m");
    expect(set("disc-radius", 17.26)).toBe("Focus disc 17.3°");
    expect(set("dwell", false)).toBe("Choosing by gaze: off");
    expect(set("quality", "low")).toBe("Quality: low");
    expect(set("tool", "select")).toBe("A tap selects");
    expect(set("tool", "measure")).toBe("Choose two points of the specimen.");
    const [{ id, name }] = START.channels;
    expect(set("opacity", 0.35, id)).toBe(`${name}: opacity 35 %`);
    expect(set("volume", false, id)).toBe(`${name}: volume off`);
  });

  it("are empty if the view shows the change", () => {
    expect(spokenFeedback("zoom-in", START, START, new Map())).toBe("");
  });
});
