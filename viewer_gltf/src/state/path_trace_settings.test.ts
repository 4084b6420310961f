import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { initialState } from "./initial_state";
import { DIALS, dialName, shareOf, valueAtShare } from "./path_trace_parameters";
import {
  gathersAnew,
  LAMP_REACH,
  LAMPS,
  MOST_STRENGTH,
  START_TRACE,
  TRACE_LIMITS,
  type TraceNumber,
  withLamp,
  withTrace,
} from "./path_trace_settings";
import { reduce } from "./reduce";

const NAMES = Object.keys(TRACE_LIMITS) as TraceNumber[];

describe("the light's settings", () => {
  it("start within their limits", () => {
    expect(withTrace(START_TRACE, {})).toEqual(START_TRACE);
    expect(START_TRACE.lamps).toHaveLength(LAMPS);
    START_TRACE.lamps.forEach((_, i) => {
      expect(withLamp(START_TRACE, i, {})).toEqual(START_TRACE);
    });
  });

  it("stay within their limits, whatever is asked for", () => {
    for (const name of NAMES) {
      const [low, high] = TRACE_LIMITS[name];
      const set = (value: number) => withTrace(START_TRACE, { [name]: value })[name];
      expect(set(low - 1), name).toBe(low);
      expect(set(high + 1e6), name).toBe(high);
      expect(set((low + high) / 2), name).toBe((low + high) / 2);
      for (const none of [Number.NaN, Number.POSITIVE_INFINITY]) {
        expect(set(none), name).toBe(START_TRACE[name]);
      }
    }
  });

  it("keep each lamp within reach, and leave the others", () => {
    const lamp = (change: object) => withLamp(START_TRACE, 1, change).lamps[1];
    expect(lamp({ x: 99, y: -99, strength: 1e9 })).toEqual({
      ...START_TRACE.lamps[1],
      x: LAMP_REACH,
      y: -LAMP_REACH,
      strength: MOST_STRENGTH,
    });
    expect(lamp({ strength: -1 }).strength).toBe(0);
    expect(lamp({ x: Number.NaN, strength: Number.NaN })).toEqual(START_TRACE.lamps[1]);
    const { lamps } = withLamp(START_TRACE, 1, { isOn: true });
    expect([lamps[0], lamps[2]]).toEqual([START_TRACE.lamps[0], START_TRACE.lamps[2]]);
    expect(withLamp(START_TRACE, 9, { isOn: true })).toEqual(START_TRACE);
  });

  it("are gathered for anew where paths depend on them, and only there", () => {
    expect(gathersAnew(START_TRACE, { ...START_TRACE })).toBe(false);
    const after = ["exposure", "hue", "saturation", "lightness", "occlusion", "sharpness"];
    for (const name of NAMES) {
      const [low] = TRACE_LIMITS[name];
      const next = withTrace(START_TRACE, { [name]: low === START_TRACE[name] ? 0.5 : low });
      expect(gathersAnew(START_TRACE, next), name).toBe(!after.includes(name));
    }
    const other = (change: object) => gathersAnew(START_TRACE, withTrace(START_TRACE, change));
    expect(other({ isPostOn: false, toneMap: "none" })).toBe(false);
    expect(other({ isMultiple: false })).toBe(true);
    expect(other({ environment: "sky" })).toBe(true);
    expect(gathersAnew(START_TRACE, withLamp(START_TRACE, 2, { isOn: true }))).toBe(true);
  });
});

describe("the light's dials", () => {
  const start = initialState(sampleManifest(1));

  it("set what they show, and nothing else", () => {
    for (const dial of DIALS) {
      for (const share of [0, 0.3, 1]) {
        const value = valueAtShare(dial, share);
        const { trace } = reduce(start, dial.to(value));
        expect(dial.of(trace), dial.id).toBeCloseTo(value, 9);
        for (const other of DIALS) {
          if (other !== dial) expect(other.of(trace)).toBe(other.of(start.trace));
        }
      }
    }
  });

  it("reach every number once, each by a name of its own", () => {
    expect(DIALS).toHaveLength(NAMES.length + 4 * LAMPS);
    expect(new Set(DIALS.map(({ id }) => id)).size).toBe(DIALS.length);
    expect(new Set(DIALS.map(dialName)).size).toBe(DIALS.length);
    for (const name of NAMES) expect(DIALS.map(({ id }) => id)).toContain(name);
  });

  it("go from one limit to the other, and back to where they stood", () => {
    for (const dial of DIALS) {
      const [low, high] = dial.limits;
      expect(valueAtShare(dial, 0)).toBeCloseTo(low, 9);
      expect(valueAtShare(dial, 1)).toBeCloseTo(high, 9);
      for (const share of [0, 0.11, 0.5, 0.93, 1]) {
        expect(shareOf(dial, valueAtShare(dial, share)), dial.id).toBeCloseTo(share, 4);
      }
      const value = dial.of(START_TRACE);
      expect(valueAtShare(dial, shareOf(dial, value)), dial.id).toBeCloseTo(value, 5);
    }
  });

  it("of factors: equal steps are equal factors", () => {
    const density = DIALS.find(({ id }) => id === "density");
    if (density === undefined) throw new Error("no dial of the density");
    const at = (share: number) => valueAtShare(density, share);
    expect(at(0.5) / at(0.25)).toBeCloseTo(at(0.75) / at(0.5), 4);
    expect(at(0.5)).toBeCloseTo(1, 4); // between a twentieth and twenty
  });
});
