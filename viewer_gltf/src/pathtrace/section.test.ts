import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { type Control, type Group, type Request, START_VIEW } from "../panel/controls";
import { initialState } from "../state/initial_state";
import { LIGHT_NUMBERS } from "../state/parameters/light";
import { LAMPS } from "../state/path_trace_settings";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import { lightItems } from "./section";

const CLOSED = initialState(sampleManifest(2));
const TRACED = reduce(CLOSED, { type: "set", id: "mode", value: "traced" });

const itemsOf = (state: ViewerState, isStereo = false) => lightItems(state, START_VIEW, isStereo);
function controlsOf(state: ViewerState, isStereo = false): readonly Control[] {
  return itemsOf(state, isStereo).flatMap((item) =>
    item.kind === "group" ? [...item.controls, ...item.more] : [item],
  );
}
function find<K extends Control["kind"]>(state: ViewerState, kind: K, id: string) {
  const found = controlsOf(state).find((control) => control.id === id);
  if (found?.kind !== kind) throw new Error(`no ${kind} ${id}`);
  return found as Extract<Control, { kind: K }>;
}
function granted(state: ViewerState, request: Request): ViewerState {
  if (typeof request === "string" || "panel" in request) throw new Error("no action");
  return reduce(state, request);
}

describe("the panel's section for path tracing", () => {
  it("begins with the button that starts path tracing, the only control in stereo until then", () => {
    for (const isStereo of [false, true]) {
      const [button, ...others] = itemsOf(CLOSED, isStereo);
      expect(others.length > 0).toBe(!isStereo);
      if (button.kind !== "button") throw new Error("no button");
      expect(granted(CLOSED, button.to()).mode).toBe("traced");
    }
  });

  it("has the same rows on a flat screen before and during path tracing, and marks those without effect", () => {
    const rows = (state: ViewerState) => controlsOf(state).map(({ id }) => id);
    expect(rows(CLOSED)).toEqual(rows(TRACED));
    const [begin, ...settings] = controlsOf(CLOSED);
    expect(begin.refusal).toBe("");
    expect(settings.filter(({ refusal }) => !refusal)).toEqual([]);
    const [begun, ...set] = controlsOf(TRACED);
    expect(begun.refusal).toContain("Path tracing is on");
    expect(set.filter(({ refusal }) => refusal)).toEqual([]);
  });

  it("gives every control a unique ID and a name", () => {
    const controls = controlsOf(TRACED);
    const ids = controls.map(({ id }) => id);
    expect(new Set(ids).size).toBe(ids.length);
    expect(controls.filter(({ label }) => label === "")).toEqual([]);
  });

  it("has a slider for every number, which covers its whole range", () => {
    const sliders = controlsOf(TRACED).filter(({ kind }) => kind === "slider");
    expect(sliders.map(({ id }) => id)).toEqual(LIGHT_NUMBERS.map(({ id }) => id));
    for (const row of LIGHT_NUMBERS) {
      const slider = find(TRACED, "slider", row.id);
      for (const end of [0, 1] as const) {
        const set = granted(TRACED, slider.to(end));
        expect(row.get(set), row.id).toBeCloseTo(row.limits[end], 6);
      }
    }
  });

  it("shows the lamps and hides them", () => {
    const toggle = find(TRACED, "toggle", "trace/lamps");
    expect(toggle.value).toBe(false);
    const shown = granted(TRACED, toggle.to(true));
    expect(shown.areLampsShown).toBe(true);
    const again = find(shown, "toggle", "trace/lamps");
    expect(again.value).toBe(true);
    expect(granted(shown, again.to(false))).toEqual(TRACED);
  });

  it("has a card for each lamp, which changes only that lamp", () => {
    const cards = itemsOf(TRACED).filter((item): item is Group => item.kind === "group");
    expect(cards.map(({ label }) => label)).toEqual(["Lamp 1", "Lamp 2", "Lamp 3"]);
    expect(cards).toHaveLength(LAMPS);
    const lit = granted(TRACED, find(TRACED, "toggle", "lamp-1/on").to(true)).trace.lamps;
    expect(lit.map(({ isOn }) => isOn)).toEqual([true, true, false]);
    const red = granted(TRACED, find(TRACED, "colour", "lamp-2/color").to("#ff0000")).trace.lamps;
    expect(red[2].color).toEqual([1, 0, 0]);
    expect(red.slice(0, 2)).toEqual(TRACED.trace.lamps.slice(0, 2));
  });

  it("offers a file of the user, except in stereo", () => {
    const own = (isStereo: boolean) =>
      controlsOf(TRACED, isStereo).some(({ label }) => label.includes(".hdr"));
    expect([own(false), own(true)]).toEqual([true, false]);
  });

  it("has the same controls in stereo, except for the file", () => {
    const ids = (isStereo: boolean) => controlsOf(TRACED, isStereo).map(({ id }) => id);
    const [onScreen, inStereo] = [ids(false), ids(true)];
    expect(onScreen.filter((id) => !inStereo.includes(id))).toEqual(["trace", "own-light"]);
    expect(inStereo).toContain("trace/lamps");
  });
});
