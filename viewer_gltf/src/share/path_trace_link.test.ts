import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { seeded } from "../../test/support/seeded";
import { fromHex } from "../math/color";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { setTo, valueAtShare } from "../state/parameters/kinds";
import { LAMP, LIGHT_NUMBERS } from "../state/parameters/light";
import { TONE_MAPS } from "../state/path_trace_settings";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import { readLight, writeLight } from "./path_trace_link";

const START = initialState(sampleManifest(1));

const write = (state: ViewerState) => writeLight(state, START);

function read(text: string): ViewerState {
  const actions = readLight(text);
  expect(actions).not.toContain(null);
  return (actions as Action[]).reduce<ViewerState>(reduce, START);
}

/** Random settings that a user could make in the panel. */
function anySettings(random: () => number): ViewerState {
  const actions: Action[] = [
    { type: "set", id: "trace-room", value: random() < 0.5 ? "sky" : "studio" },
    { type: "set", id: "trace-tone-map", value: TONE_MAPS[random() < 0.5 ? 0 : 1] },
    { type: "set", id: "trace/multiple", value: random() < 0.5 },
    { type: "set", id: "trace/post", value: random() < 0.5 },
  ];
  for (const row of LIGHT_NUMBERS) {
    const share = Math.round(100 * random()) / 100;
    if (random() < 0.5) actions.push(setTo(row, valueAtShare(row, share)));
  }
  for (const { color, isOn } of LAMP) {
    const hex = `#${Math.floor(random() * 0x1000000)
      .toString(16)
      .padStart(6, "0")}`;
    if (random() < 0.5) actions.push(setTo(color, fromHex(hex)));
    if (random() < 0.5) actions.push(setTo(isOn, random() < 0.5));
  }
  return actions.reduce<ViewerState>(reduce, START);
}

describe("the light in a link", () => {
  it("is empty if it is the light with which a bundle opens", () => {
    expect(write(START)).toBe("");
  });

  it("is the same after writing and reading, for any settings", () => {
    const random = seeded(4);
    for (let i = 0; i < 200; i++) {
      const state = anySettings(random);
      const { trace } = state;
      const text = write(state);
      expect(text).toMatch(/^[-a-zA-Z0-9_:,./+]*$/); // no character that an address would escape
      const back = text === "" ? START : read(text);
      for (const row of LIGHT_NUMBERS) {
        expect(row.get(back), row.id).toBeCloseTo(row.get(state), 4);
      }
      expect(write(back)).toBe(text);
      const { environment, toneMap, isMultiple, isPostOn, lamps } = back.trace;
      expect({ environment, toneMap, isMultiple, isPostOn }).toEqual({
        environment: trace.environment,
        toneMap: trace.toneMap,
        isMultiple: trace.isMultiple,
        isPostOn: trace.isPostOn,
      });
      lamps.forEach(({ isOn, color }, k) => {
        expect(isOn).toBe(trace.lamps[k].isOn);
        color.forEach((v, c) => {
          expect(v).toBeCloseTo(trace.lamps[k].color[c], 2);
        });
      });
    }
  });

  it("reads the same if an earlier version wrote it in another order", () => {
    const { trace } = read(
      "bias:0.25,lamp-1/x:2.5,exposure:1.5,room:sky,tone:none,many:false,after:false,lamp-1:true,lamp-1/color:ff8800",
    );
    expect(trace).toMatchObject({ bias: 0.25, exposure: 1.5, environment: "sky", toneMap: "none" });
    expect(trace).toMatchObject({ isMultiple: false, isPostOn: false });
    expect(trace.lamps[1]).toMatchObject({ x: 2.5, isOn: true, color: fromHex("#ff8800") });
  });

  it("leaves out the user's own environment image", () => {
    expect(write({ ...START, trace: { ...START.trace, environment: "own" } })).toBe("");
    expect(readLight("room:own")).toEqual([null]);
  });

  it("is reported part by part if it can't be read", () => {
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
      expect(readLight(part), part).toEqual([null]);
    }
    const [one, none, other] = readLight("hue:20,what,sharpness:1");
    expect([one, none, other].map((action) => action !== null)).toEqual([true, false, true]);
  });

  it("never exceeds the limits of parameters, and never throws, for any text", () => {
    const random = seeded(9);
    const pieces = [
      ...LIGHT_NUMBERS.map(({ link }) => link),
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
      const actions = readLight(text).filter((action) => action !== null);
      const state = actions.reduce<ViewerState>(reduce, START);
      for (const { id, get, limits } of LIGHT_NUMBERS) {
        const value = get(state);
        expect(value >= limits[0] && value <= limits[1], `${id} of ${text}`).toBe(true);
      }
    }
  });
});
