import { describe, expect, it } from "vitest";
import { FLAT_FACTS } from "../../test/support/fixture/facts";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { buildPanel, CHANNELS_OF_A_PAGE, type Facts } from "../../test/support/panel/whole_panel";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { DISC_RADIUS, SWITCH_DISTANCE } from "../state/parameters/volumes";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import {
  type Control,
  changePanel,
  type Group,
  type Layout,
  type PanelView,
  type Request,
  START_VIEW,
} from "./controls";
import { PALETTES } from "./palettes";

const FACTS: Facts = { ...FLAT_FACTS, ranges: new Map([["c0", [100, 1120]]]) };
const start = (channels = 3) => initialState(sampleManifest(channels));

function controlsOf(layout: Layout): readonly Control[] {
  return layout.sections
    .flatMap(({ items }) => items)
    .flatMap((item) => (item.kind === "group" ? [...item.controls, ...item.more] : [item]));
}

function find<K extends Control["kind"]>(layout: Layout, kind: K, id: string) {
  const found = controlsOf(layout).find((control) => control.id === id);
  if (found?.kind !== kind) throw new Error(`no ${kind} ${id}`);
  return found as Extract<Control, { kind: K }>;
}

function granted(state: ViewerState, request: Request): ViewerState {
  if (typeof request === "string" || "panel" in request) throw new Error("no action");
  return reduce(state, request);
}

const laid = (state: ViewerState, view: PanelView = START_VIEW, facts = FACTS) =>
  buildPanel(state, facts, view);
const channelsOf = (layout: Layout) =>
  layout.sections[0].items.filter((item): item is Group => item.kind === "group");

/** Turns all channels into label maps, which have no volumes. */
const ofObjects = (state: ViewerState): ViewerState => ({
  ...state,
  channels: state.channels.map((channel) => ({ ...channel, hasObjects: true })),
});

describe("the panel's layout", () => {
  it("has no sections for volumes if there are only objects", () => {
    const names = (state: ViewerState) => laid(state).sections.map(({ id }) => id);
    const [all, left] = [names(start()), names(ofObjects(start()))];
    expect(left.filter((id) => id.startsWith("objects"))).toHaveLength(3);
    expect(all.filter((id) => !left.includes(id))).toEqual([
      "volumes",
      "slices",
      "volume-settings",
      "light",
    ]);
    const [first, ...others] = start().channels;
    const mixed = { ...start(), channels: [...ofObjects(start()).channels, first, ...others] };
    expect(names(mixed).filter((id) => !id.startsWith("objects"))).toEqual(all);
  });

  it("opens with at most twelve rows, and lists the other sections under More", () => {
    const layout = laid(start(4));
    const first = layout.sections.filter(({ isDeeper }) => !isDeeper);
    const rows = first.map(({ isOpen, items }) => (isOpen ? items.length : 1));
    expect(rows.reduce((sum, each) => sum + each, 1)).toBeLessThanOrEqual(12); // one row for More
    expect(layout.more.isOpen).toBe(false);
    const names = first.map(({ id }) => id);
    expect(names).toEqual(["channels", "volumes", "tiles", "cut", "slices", "save", "stereo"]);
    const deeper = layout.sections.filter(({ isDeeper }) => isDeeper).map(({ id }) => id);
    expect(deeper).toEqual(
      expect.arrayContaining(["view", "measure", "light", "share", "quality"]),
    );
  });

  it("begins with the slices if the specimen is a patient", () => {
    const names = (facts: Partial<typeof FACTS>) =>
      laid(start(), START_VIEW, { ...FACTS, ...facts }).sections.map(({ id }) => id);
    expect(names({ isPatient: true })[0]).toBe("slices");
    expect(names({ isPatient: true }).toSorted()).toEqual(names({}).toSorted());
    expect(names({ isPatient: true, isStereo: true })[0]).toBe("channels");
  });

  it("reports the shown forms, whether they are complete, and that nothing is shown", () => {
    const status = (state: ViewerState, facts: Partial<Facts> = {}) =>
      laid(state, START_VIEW, { ...FACTS, ...facts }).status;
    expect(status(start())).toBe("Surfaces, volumes when near · complete");
    expect(status(start(), { isLoading: true })).toBe("Surfaces, volumes when near · loading …");
    const off = reduce(start(), { type: "set", id: "mode", value: "off" });
    expect(status(off)).toBe("Surfaces · complete");
    const [tile, ...others] = off.tiles;
    const unfinished = { ...off, tiles: [{ ...tile, isUnfinished: true as const }, ...others] };
    expect(status(unfinished)).toBe("Volumes until all surfaces are built");
    const without = off.tiles.map((each) => ({ ...each, isUnfinished: true as const }));
    expect(status({ ...off, tiles: without })).toBe("Volumes");
    const all = reduce(unfinished, { type: "set", id: "mode", value: "all" });
    expect(status(all)).toBe("Volumes");
    const none = { ...off, channels: off.channels.map((each) => ({ ...each, shown: false })) };
    expect(status(none)).toBe("All channels are hidden");
  });

  it("gives every control a unique id, and a label", () => {
    const controls = controlsOf(laid(start(70)));
    const ids = controls.map(({ id }) => id);
    expect(new Set(ids).size).toBe(ids.length);
    expect(controls.filter(({ label }) => label === "")).toEqual([]);
  });

  it("sets each part of a channel to the value of its control", () => {
    const state = start();
    const layout = laid(state);
    const channel = (request: Request) => granted(state, request).channels[0];
    expect(channel(find(layout, "toggle", "c0/shown").to(false)).shown).toBe(false);
    expect(channel(find(layout, "toggle", "c0/volume").to(false)).volume).toBe(false);
    expect(channel(find(layout, "slider", "c0/opacity").to(0.25)).opacity).toBe(0.25);
    expect(channel(find(layout, "window", "c0/window").to([0.25, 0.5])).window).toEqual([
      0.25, 0.5,
    ]);
    const transfer = find(layout, "choice", "c0/transfer-function");
    expect(transfer.options.map(({ value }) => value)).toEqual(["default", "soft"]);
    expect(channel(transfer.to("soft")).transferFunction).toBe("soft");
    expect(channel(find(layout, "colour", "c0/color").to("#0000ff")).color).toEqual([0, 0, 1]);
  });

  it("shows the window in the values of the source if they are known", () => {
    const state = reduce(start(), { type: "window", channel: "c0", window: [0.25, 0.5] });
    expect(find(laid(state), "window", "c0/window").texts).toEqual(["355", "610"]);
    expect(find(laid(state), "window", "c2/window").texts).toEqual(["0 %", "100 %"]);
  });

  it("offers the usual colours of dyes, and colours for the colour-blind", () => {
    const { palettes } = find(laid(start()), "colour", "c0/palette");
    expect(palettes).toBe(PALETTES);
    const names = palettes.flatMap(({ colors }) => colors.map(({ name }) => name)).join();
    for (const dye of ["DAPI", "FITC", "TRITC", "Cy3", "Cy5"]) expect(names).toContain(dye);
    for (const { hex } of palettes.flatMap(({ colors }) => colors)) {
      expect(hex).toMatch(/^#[0-9a-f]{6}$/); // as the colour of a state is written, so that the chosen colour is marked
    }
  });

  it("lists the shown ones of seventy channels, and one page of the others", () => {
    const layout = laid(start(70));
    const [cards, others] = [channelsOf(layout).slice(0, 4), channelsOf(layout).slice(4)];
    expect(cards.map(({ id }) => id)).toEqual(["c0", "c1", "c2", "c3"]);
    expect(others).toHaveLength(CHANNELS_OF_A_PAGE);
    const next = find(layout, "button", "next-channels").to();
    if (typeof next === "string" || !("panel" in next)) throw new Error("no change of the panel");
    const second = channelsOf(laid(start(70), changePanel(START_VIEW, next))).slice(4);
    expect(second[0].id).toBe(`c${4 + CHANNELS_OF_A_PAGE}`);
  });

  it("finds a channel by part of its name", () => {
    const request = find(laid(start(70)), "search", "find-channel").to("marker 42");
    if (typeof request === "string" || !("panel" in request))
      throw new Error("no change of the panel");
    const found = channelsOf(laid(start(70), changePanel(START_VIEW, request)));
    expect(found.map(({ id }) => id)).toEqual(["c0", "c1", "c2", "c3", "c42"]);
    const nothing = laid(start(70), { ...START_VIEW, search: "CD999" });
    expect(find(nothing, "text", "no-channel").value).toContain("CD999");
  });

  it("opens one channel's card at a time", () => {
    const [first] = channelsOf(laid(start()));
    expect(first.isOpen).toBe(false);
    const opened = channelsOf(laid(start(), changePanel(START_VIEW, first.opener)));
    expect(opened.map(({ isOpen }) => isOpen)).toEqual([true, false, false]);
  });

  it("maps the ends of a slider to the limits, and each step to itself", () => {
    const state = start();
    const layout = laid(state);
    for (const [row, key] of [
      [SWITCH_DISTANCE, "switchDistance_m"],
      [DISC_RADIUS, "discRadius_deg"],
    ] as const) {
      const { id, limits } = row;
      const slider = find(layout, "slider", id);
      const [least, most] = limits;
      expect(granted(state, slider.to(0))[key]).toBe(least);
      expect(granted(state, slider.to(1))[key]).toBe(most);
      for (let step = 0; step <= slider.steps; step++) {
        const moved = find(laid(granted(state, slider.to(step / slider.steps))), "slider", id);
        expect(Math.round(moved.value * slider.steps), `${id} ${step}`).toBe(step);
      }
    }
  });

  it("maps the tiles by row and column, and marks the gazed, selected and isolated ones", () => {
    const actions: Action[] = [
      { type: "select", tile: "r0_c1" },
      { type: "isolate", tile: "r0_c4" },
    ];
    const map = find(laid(actions.reduce(reduce, start())), "map", "tile-map");
    expect([map.rows, map.columns, map.tiles.length]).toEqual([2, 5, 10]);
    const marked = (mark: "isFocus" | "isSelected" | "isIsolated") =>
      map.tiles.filter((tile) => tile[mark]).map(({ row, column }) => [row, column]);
    expect(marked("isFocus")).toEqual([[1, 2]]);
    expect(marked("isSelected")).toEqual([[0, 4]]);
    expect(marked("isIsolated")).toEqual([[0, 4]]);
  });

  it("selects a tile, isolates it when chosen again, and then shows all", () => {
    let state = start();
    const choose = () => {
      state = granted(state, find(laid(state), "map", "tile-map").to("r0_c3"));
      return [state.selected, state.isolated];
    };
    expect(choose()).toEqual(["r0_c3", null]);
    expect(choose()).toEqual(["r0_c3", "r0_c3"]);
    expect(choose()).toEqual(["r0_c3", null]);
  });

  it("reports the radius at which the limit of tiles ends the focus disc", () => {
    const now = (state: ViewerState, discLimit_deg: number | null) =>
      find(laid(state, START_VIEW, { ...FACTS, discLimit_deg }), "slider", "disc-radius").text;
    const set = now(start(), null);
    expect(now(start(), 3.2)).toBe(`${set}, now 3°`);
    expect(now(reduce(start(), { type: "set", id: "mode", value: "all" }), 3.2)).toBe(set);
  });

  it("has no section of tiles if there is only one", () => {
    const names = (state: ViewerState) => laid(state).sections.map(({ id }) => id);
    const { tiles, ...rest } = start();
    const all = names({ tiles, ...rest });
    const single = names({ tiles: tiles.slice(0, 1), ...rest });
    expect(all.filter((id) => !single.includes(id))).toEqual(["tiles"]);
  });

  it("lists the tiles if their names are not rows and columns", () => {
    const tiles = ["left", "right"].map((id) => ({ id, representation: "mesh" }) as const);
    const state = { ...start(), tiles };
    const list = find(laid(state), "choice", "tile-choice");
    expect(list.options.map(({ value }) => value)).toEqual(["", "left", "right"]);
    expect(granted(state, list.to("left")).selected).toBe("left");
  });

  it("cuts at the specimen's middle, and not at all when turned off", () => {
    let state = start();
    state = granted(state, find(laid(state), "toggle", "clip-box").to(true));
    expect(state.clip.box).toEqual({ min: [12.5, -15, 2], max: [37.5, -5, 6] });
    state = granted(state, find(laid(state), "toggle", "clip-plane").to(true));
    expect(state.clip.plane).toEqual({ normal: [0, 0, 1], offset_um: 4 });
    state = granted(state, find(laid(state), "toggle", "clip-box").to(false));
    expect(state.clip.box).toBeNull();
    expect(state.clip.plane).not.toBeNull();
  });

  it("gives each of several label maps a section of its own", () => {
    const named = (count: number) => {
      const state = ofObjects(start());
      const channels = state.channels.map((each, i) => ({ ...each, shown: i < count }));
      return laid({ ...state, channels })
        .sections.filter(({ id }) => id.startsWith("objects"))
        .map(({ id, label }) => [id, label]);
    };
    const [one, other] = start().channels;
    expect(named(0)).toEqual([]);
    expect(named(1)).toEqual([["objects", "Objects"]]);
    expect(named(2)).toEqual([
      [`objects/${one.id}`, `Objects: ${one.name}`],
      [`objects/${other.id}`, `Objects: ${other.name}`],
    ]);
  });

  it("keeps the place of a label map's section until its table is loaded", () => {
    const ids = (objects: Facts["objects"]) =>
      laid(ofObjects(start(1)), START_VIEW, { ...FACTS, objects }).sections.map(({ id }) => id);
    const items = [{ kind: "text", id: "objects-count", label: "Objects", value: "3" } as const];
    expect(ids([])).toEqual(ids([{ id: "c0", items }]));
    expect(ids([])).toContain("objects");
  });

  it("shows the colours of the objects beside a label map's name, or the one colour that all have", () => {
    const state = ofObjects(start());
    const shows = (colors: readonly string[]) => {
      const objectColors = new Map([["c0", colors]]);
      const layout = laid(state, START_VIEW, { ...FACTS, objectColors });
      return ["c0/color", "c1/color"].map((id) => find(layout, "colour", id).shows);
    };
    expect(shows(["#112233", "#445566"])).toEqual([["#112233", "#445566"], []]);
    expect(shows([])).toEqual([[], []]);
  });

  it("offers to try again in stereo while a notice shows a fault that may pass", () => {
    const facts = { ...FACTS, isStereo: true };
    const withNotice = (isRetryable: boolean) =>
      reduce(start(), { type: "notify", text: "a fault", isRetryable });
    const retry = find(laid(withNotice(true), START_VIEW, facts), "button", "retry");
    expect(retry.to()).toBe("retry");
    const others = controlsOf(laid(withNotice(false), START_VIEW, facts)).map(({ id }) => id);
    expect(others).toContain("dismiss-0");
    expect(others).not.toContain("retry");
  });

  it("cuts an isolated tile at its own middle", () => {
    const facts = { ...FACTS, shown: { min: [0, -10, 0], max: [10, 0, 6] } } as const;
    const layout = laid(start(), START_VIEW, facts);
    const clipOf = (id: string) => granted(start(), find(layout, "toggle", id).to(true)).clip;
    expect(clipOf("clip-box").box).toEqual({ min: [2.5, -7.5, 1.5], max: [7.5, -2.5, 4.5] });
    expect(clipOf("clip-plane").plane?.offset_um).toBe(3);
  });

  it("shows the measured distance, and the channels' values at both ends", () => {
    const points = [
      [0, 0, 0],
      [3, 4, 0],
    ] as const;
    const state = reduce(start(), { type: "measure", points });
    const facts = { ...FACTS, values: [["Marker 0 12", "Marker 1 7"], ["Marker 0 512"]] };
    const textsOf = (layout: Layout) =>
      controlsOf(layout).flatMap((each) =>
        each.kind === "text" && /^(distance|values-.)$/.test(each.id)
          ? [`${each.label}: ${each.value}`]
          : [],
      );
    expect(textsOf(laid(state, START_VIEW, facts))).toEqual([
      "Measured: 5.00 µm",
      "First point: Marker 0 12 · Marker 1 7",
      "Second point: Marker 0 512",
    ]);
    expect(find(laid(state), "text", "values-0").value).toBe(""); // so the row is hidden
    expect(find(laid(state), "button", "clear-measured").refusal).toBe("");
  });

  it("reports why stereo is not available, and omits kinds that the viewer lacks", () => {
    const layout = laid(start());
    expect(find(layout, "button", "stereo").refusal).toBe("No headset was found.");
    expect(controlsOf(layout).some(({ id }) => id === "split")).toBe(false);
    const split = { isAvailable: true, reason: "" };
    const had = laid(start(), START_VIEW, { ...FACTS, split });
    expect(find(had, "button", "split").to()).toBe("split");
    expect(find(had, "button", "split").refusal).toBe("");
  });

  it("accepts the code of another Cardboard viewer, and reports its faults", () => {
    const faultOfCode = (code: string) => (code === "" ? "The code is empty." : "");
    const facts = { ...FACTS, split: { isAvailable: true, reason: "" }, faultOfCode };
    const other = changePanel(START_VIEW, { panel: "lenses", lenses: "own" });
    const refusal = (text: string) => {
      const view = changePanel(other, { panel: "code", text });
      return find(laid(start(), view, facts), "button", "split").refusal;
    };
    expect(refusal("")).toBe("The code is empty.");
    expect(refusal("https://g.co/cardboard")).toBe("");
    const has = (canScan: boolean) =>
      JSON.stringify(laid(start(), other, { ...facts, canScan })).includes("Scan the code");
    expect([has(true), has(false)]).toEqual([true, false]);
  });

  it("requests the views by command, and shows the figures", () => {
    const layout = laid(start());
    for (const id of ["front", "side", "top", "reset", "share"] as const) {
      expect(find(layout, "button", id).to()).toBe(id);
    }
    const figures = (facts: Partial<Facts>) => {
      const measured = laid(start(), START_VIEW, { ...FACTS, ...facts });
      return ["triangles", "volume-detail", "frame-time"].map(
        (id) => find(measured, "text", id).value,
      );
    };
    expect(figures({})).toEqual(["12 k triangles", "at 1/2 detail", "12 ms"]);
    expect(figures({ triangles: 0, volumeLevel: 0 })).toEqual(["none", "in full detail", "12 ms"]);
    expect(figures({ triangles: 12, volumeLevel: null })).toEqual([
      "12 triangles",
      "none",
      "12 ms",
    ]);
    expect(find(layout, "text", "settings").value).toBe("64 steps per ray, 50 % resolution");
  });
});
