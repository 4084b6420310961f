import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { initialState } from "./initial_state";
import { type Value, withValue } from "./parameters/kinds";
import { AFTER, LAMP, LIGHT, LIGHT_NUMBERS } from "./parameters/light";
import { LAMPS, needsNewPaths, START_TRACE, withLamp } from "./path_trace_settings";

const START = initialState(sampleManifest(1));

describe("the settings of path tracing", () => {
  it("start within their limits", () => {
    expect(START.trace).toEqual(START_TRACE);
    expect(LAMP).toHaveLength(LAMPS);
    for (const row of LIGHT_NUMBERS) {
      expect(withValue(row, START, row.get(START)), row.id).toBe(START);
    }
  });

  it("leave the other lamps unchanged if one lamp changes", () => {
    const { lamps } = withLamp(START_TRACE, 1, { isOn: true });
    expect([lamps[0], lamps[2]]).toEqual([START_TRACE.lamps[0], START_TRACE.lamps[2]]);
    expect(lamps[1]).toEqual({ ...START_TRACE.lamps[1], isOn: true });
    expect(withLamp(START_TRACE, 9, { isOn: true })).toEqual(START_TRACE);
  });

  it("need new paths only where paths depend on them", () => {
    expect(needsNewPaths(START_TRACE, { ...START_TRACE })).toBe(false);
    for (const row of LIGHT) {
      const other = (): Value => {
        if (row.kind === "number") return row.limits[row.get(START) === row.limits[0] ? 1 : 0];
        if (row.kind === "switch") return !row.get(START);
        if (row.kind === "colour") return [0, 1, 0];
        return row.values.find((value) => value !== row.get(START)) ?? "";
      };
      const { trace } = withValue(row, START, other());
      expect(trace, row.id).not.toEqual(START_TRACE);
      expect(needsNewPaths(START_TRACE, trace), row.id).toBe(!AFTER.includes(row));
    }
  });
});
