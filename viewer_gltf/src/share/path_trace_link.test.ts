import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { seeded } from "../../test/support/seeded";
import { fromHex } from "../math/color";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { DIALS, valueAtShare } from "../state/path_trace_parameters";
import { LAMPS, START_TRACE, TONE_MAPS, type TraceSettings } from "../state/path_trace_settings";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import { readTrace, writeTrace } from "./path_trace_link";

const START = initialState(sampleManifest(1));

function read(text: string): TraceSettings {
  const actions = readTrace(text);
  expect(actions).not.toContain(null);
  return (actions as Action[]).reduce<ViewerState>(reduce, START).trace;
}

/** Any settings that a panel can make. */
function anySettings(random: () => number): TraceSettings {
  const actions: Action[] = [];
  for (const dial of DIALS) {
    if (random() < 0.5) actions.push(dial.to(valueAtShare(dial, Math.round(100 * random()) / 100)));
  }
  for (let lamp = 0; lamp < LAMPS; lamp++) {
    const hex = `#${Math.floor(random() * 0x1000000)
      .toString(16)
      .padStart(6, "0")}`;
    if (random() < 0.5) actions.push({ type: "move-lamp", lamp, change: { color: fromHex(hex) } });
    if (random() < 0.5) actions.push({ type: "move-lamp", lamp, change: { isOn: random() < 0.5 } });
  }
  const change = {
    environment: random() < 0.5 ? "sky" : "studio",
    toneMap: TONE_MAPS[random() < 0.5 ? 0 : 1],
    isMultiple: random() < 0.5,
    isPostOn: random() < 0.5,
  } as const;
  return [...actions, { type: "trace", change } as const].reduce<ViewerState>(reduce, START).trace;
}

describe("the light in a link", () => {
  it("is nothing where it is what a bundle opens with", () => {
    expect(writeTrace(START_TRACE)).toBe("");
  });

  it("comes back as it was, whatever was set", () => {
    const random = seeded(4);
    for (let i = 0; i < 200; i++) {
      const trace = anySettings(random);
      const text = writeTrace(trace);
      expect(text).toMatch(/^[-a-zA-Z0-9_:,./+]*$/); // nothing that an address would change
      const back = text === "" ? START_TRACE : read(text);
      for (const dial of DIALS) {
        expect(dial.of(back), dial.id).toBeCloseTo(dial.of(trace), 4);
      }
      expect(writeTrace(back)).toBe(text);
      const { environment, toneMap, isMultiple, isPostOn } = back;
      expect({ environment, toneMap, isMultiple, isPostOn }).toEqual({
        environment: trace.environment,
        toneMap: trace.toneMap,
        isMultiple: trace.isMultiple,
        isPostOn: trace.isPostOn,
      });
      back.lamps.forEach(({ isOn, color }, k) => {
        expect(isOn).toBe(trace.lamps[k].isOn);
        color.forEach((v, c) => {
          expect(v).toBeCloseTo(trace.lamps[k].color[c], 2);
        });
      });
    }
  });

  it("leaves the user's own picture of light with the user", () => {
    expect(writeTrace({ ...START_TRACE, environment: "own" })).toBe("");
    expect(readTrace("room:own")).toEqual([null]);
  });

  it("that can't be read is told of, part by part", () => {
    for (const part of [
      "",
      "bias",
      "bias:",
      "bias:x",
      "bias:1,2".replace(",", ";"),
      "bias:NaN",
      "bias:Infinity",
      "bias:1e999",
      "room:cellar",
      "tone:true",
      "many:1",
      "after:TRUE",
      "lamp-3:true",
      "lamp-9/color:ffffff",
      "lamp-0/color:#ffffff",
      "lamp-0/color:fff",
      "lamp-0/size:1",
      "lamp-:true",
      "constructor:1",
      "__proto__:1",
    ]) {
      expect(readTrace(part), part).toEqual([null]);
    }
    const [one, none, other] = readTrace("hue:20,what,sharpness:1");
    expect([one, none, other].map((action) => action !== null)).toEqual([true, false, true]);
  });

  it("never leads beyond the limits, nor throws, whatever it says", () => {
    const random = seeded(9);
    const pieces = [
      ...DIALS.map(({ id }) => id),
      "room",
      "tone",
      ":",
      ",",
      "-",
      "1e7",
      "-9e6",
      "sky",
      "0.5",
      "é",
      "%",
    ];
    for (let i = 0; i < 500; i++) {
      const length = Math.floor(12 * random());
      const text = Array.from({ length }, () => pieces[Math.floor(random() * pieces.length)]).join(
        "",
      );
      const actions = readTrace(text).filter((action) => action !== null);
      const { trace } = actions.reduce<ViewerState>(reduce, START);
      for (const { id, of, limits } of DIALS) {
        const value = of(trace);
        expect(value >= limits[0] && value <= limits[1], `${id} of ${text}`).toBe(true);
      }
    }
  });
});
