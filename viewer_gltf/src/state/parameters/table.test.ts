import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../../test/support/fixture/manifest";
import { initialState } from "../initial_state";
import { reduce } from "../reduce";
import { CHANNEL } from "./channel";
import { type NumberParameter, setTo, shareOf, valueAtShare } from "./kinds";
import { LIGHT_NUMBERS } from "./light";
import { allParameters, parametersInAddress } from "./table";
import { MODE } from "./volumes";

const PARAMETERS = allParameters();
const START = initialState(sampleManifest(2));
const NUMBERS = PARAMETERS.filter((row) => row.kind === "number");

function isUnique(names: readonly (string | undefined)[]): boolean {
  const given = names.filter((name) => name !== undefined);
  return new Set(given).size === given.length;
}

describe("the parameters", () => {
  it("have unique ids, and unique names in a link", () => {
    expect(isUnique(PARAMETERS.map(({ id }) => id))).toBe(true);
    expect(isUnique(PARAMETERS.map(({ link }) => link))).toBe(true);
    expect(isUnique(CHANNEL.map(({ link }) => link))).toBe(true);
    expect(parametersInAddress().every(({ link }) => link !== undefined)).toBe(true);
    // in a channel's part of a link, a letter names the parameter
    expect(CHANNEL.every(({ link }) => link?.length === 1 && !"wst".includes(link))).toBe(true);
  });

  it("set their own value and no other", () => {
    for (const row of NUMBERS) {
      for (const share of [0, 0.3, 1]) {
        const value = valueAtShare(row, share);
        const set = reduce(START, setTo(row, value));
        expect(row.get(set), row.id).toBeCloseTo(value, 9);
        for (const other of PARAMETERS) {
          if (other !== row) expect(other.get(set), other.id).toEqual(other.get(START));
        }
      }
    }
  });

  it("stay within their limits for any requested value", () => {
    for (const row of NUMBERS) {
      const [low, high] = row.limits;
      const set = (value: number) => row.get(reduce(START, setTo(row, value)));
      expect(set(low - 1), row.id).toBe(low);
      expect(set(high + 1e6), row.id).toBe(high);
      expect(set((low + high) / 2), row.id).toBe((low + high) / 2);
      for (const none of [Number.NaN, Number.POSITIVE_INFINITY]) {
        expect(set(none), row.id).toBe(row.get(START));
      }
    }
  });

  it("accept no value of another kind", () => {
    for (const { id, kind } of PARAMETERS) {
      for (const value of ["cube", 7, true, [1, 0, 0]] as const) {
        if (kind === "number" && value === 7) continue;
        if (kind === "switch" && value === true) continue;
        if (kind === "colour" && typeof value === "object") continue;
        expect(reduce(START, { type: "set", id, value }), id).toBe(START);
      }
    }
  });

  it("leave the state unchanged if it has the value already", () => {
    for (const row of PARAMETERS) {
      const value = row.get(START);
      expect(reduce(START, { type: "set", id: row.id, value }), row.id).toBe(START);
    }
    const [{ id: channel }] = START.channels;
    expect(reduce(START, { type: "set", id: "opacity", value: 1, channel })).toBe(START);
  });

  it("leave the other channels unchanged if they belong to one channel", () => {
    const [first, second] = START.channels;
    const set = reduce(START, { type: "set", id: "opacity", value: 0.25, channel: second.id });
    expect(set.channels).toEqual([first, { ...second, opacity: 0.25 }]);
  });

  it("report in a notice what this device does not support", () => {
    const poor = initialState(sampleManifest(1), false);
    const asked = reduce(poor, setTo(MODE, "traced"));
    expect(asked.mode).toBe(poor.mode);
    expect(asked.notices).toHaveLength(1);
  });

  it("throw an error if their name is unknown", () => {
    expect(() => reduce(START, { type: "set", id: "size", value: 1 })).toThrow("no parameter size");
    const action = JSON.parse('{"type": "wind-clock"}');
    expect(() => reduce(START, action)).toThrow('no part has the action {"type":"wind-clock"}');
  });
});

describe("a number's slider", () => {
  const sliders: readonly NumberParameter<typeof START>[] = NUMBERS;

  it("goes from one limit to the other, and returns the same place for a value", () => {
    for (const row of sliders) {
      const [low, high] = row.limits;
      expect(valueAtShare(row, 0), row.id).toBeCloseTo(low, 9);
      expect(valueAtShare(row, 1), row.id).toBeCloseTo(high, 9);
      const value = row.get(START);
      expect(valueAtShare(row, shareOf(row, value)), row.id).toBeCloseTo(value, 5);
    }
    for (const row of LIGHT_NUMBERS) {
      for (const share of [0, 0.11, 0.5, 0.93, 1]) {
        expect(shareOf(row, valueAtShare(row, share)), row.id).toBeCloseTo(share, 4);
      }
    }
  });

  it("on a logarithmic scale has equal factors for equal steps", () => {
    const density = LIGHT_NUMBERS.find(({ link }) => link === "density");
    if (density === undefined) throw new Error("no number of the density");
    const at = (share: number) => valueAtShare(density, share);
    expect(at(0.5) / at(0.25)).toBeCloseTo(at(0.75) / at(0.5), 4);
    expect(at(0.5)).toBeCloseTo(1, 4); // the middle of the limits 0.05 and 20 on a logarithmic scale
  });
});
