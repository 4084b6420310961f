import { describe, expect, it } from "vitest";
import { PARTS } from "../../test/support/all_parts";
import { SPECIMEN_BOX, sampleManifest } from "../../test/support/fixture/manifest";
import { KEYS, NO_SLICES } from "../../test/support/panel/all_keys";
import type { Action, PartAction } from "../state/actions";
import { OWN_COMMANDS } from "../state/commands";
import { initialState } from "../state/initial_state";
import { CHANNEL } from "../state/parameters/channel";
import type { Parameter } from "../state/parameters/kinds";
import { LIGHT_NUMBERS } from "../state/parameters/light";
import { allParameters } from "../state/parameters/table";
import { STEREO_NUMBERS } from "../state/parameters/tools";
import { rowsOfParts } from "../state/part_settings";
import { reduce } from "../state/reduce";
import { REFUSED as REASONS } from "../state/refusals";
import { makeShape } from "../state/transfer_shapes";
import type { ViewerState } from "../state/viewer_state";
import { type PanelChange, START_VIEW } from "./controls";
import { isRefusal, type KeyContext } from "./key";
import { spokenFeedback } from "./spoken_feedback";

/**
 * Whether a parameter is a number without keys of its own. One key chooses such a number, and two
 * keys change it.
 */
const isTurned = (row: Parameter<ViewerState>) => row.kind === "number" && row.keys === undefined;

const ALL = KEYS.groups.flatMap(({ keys }) => keys);
const CONTEXT: KeyContext = {
  state: [
    {
      type: "measure",
      points: [
        [0, 0, 0],
        [3, 4, 0],
      ],
    } as const,
    { type: "keep-views", views: [{ position: [0, 0, 2], target: [0, 0, 0] }] } as const,
    { type: "notify", text: "a fault", isRetryable: true } as const,
    { type: "set-clip", clip: { box: SPECIMEN_BOX, plane: null } } as const,
    {
      type: "set-shapes",
      channel: "c0",
      name: "own",
      shapes: [makeShape("rectangle", { value: 0.5, gradient: 0.5 })],
    } as const,
    {
      type: "learn-transfer-2d",
      channel: "c0",
      transfer2d: { gradient_max: 0.5, functions: {} },
    } as const,
    { type: "hide-additions", hidden: [], all: ["/Specimen/Arrow"] } as const,
    { type: "set", id: "mode", value: "traced" } as const,
  ].reduce<KeyContext["state"]>(reduce, initialState(sampleManifest(12))),
  view: START_VIEW,
  shown: SPECIMEN_BOX,
  focusTile: "r0_c2",
};

/** The same context, but volumes are marched, slices are shown and a tap measures. */
const MARCHED: KeyContext = {
  ...CONTEXT,
  state: [
    { type: "set", id: "mode", value: "disc" } as const,
    { type: "set", id: "slice-pictures", value: true } as const,
    { type: "set", id: "tool", value: "measure" } as const,
    { type: "select", tile: "r0_c2" } as const,
  ].reduce<KeyContext["state"]>(reduce, CONTEXT.state),
};
/** The same context, but only volumes are shown. */
const EVERYWHERE: KeyContext = {
  ...MARCHED,
  state: reduce(MARCHED.state, { type: "set", id: "mode", value: "all" } as const),
};
const CONTEXTS = [CONTEXT, MARCHED, EVERYWHERE];

/** The requests of all keys that have an effect. */
const allRequests = () =>
  CONTEXTS.flatMap((context) =>
    ALL.flatMap(({ to, keys }) => keys.map((name) => to(context, name))),
  ).filter((answer) => !isRefusal(answer));

const REFUSED = { refusal: expect.stringMatching(/^[A-Z].*\.$/) };

describe("the keys", () => {
  it("have one function each, with a label", () => {
    const names = ALL.flatMap(({ keys }) => keys);
    expect(new Set(names).size).toBe(names.length);
    expect(ALL.filter(({ label }) => label.length < 3)).toEqual([]);
  });

  it("reach every action and every command", () => {
    const requests = allRequests();
    const actions = new Set(
      requests.flatMap((request) =>
        request !== null && typeof request !== "string" && "type" in request ? [request.type] : [],
      ),
    );
    const wanted: Readonly<Record<Exclude<Action, PartAction>["type"], boolean>> = {
      set: true,
      objects: false, // the panel and taps send it
      show: true,
      window: true,
      "choose-transfer-function": true,
      "set-shapes": true,
      "learn-transfer-2d": false, // the loader sends it
      select: true,
      isolate: true,
      "set-clip": true,
      measure: true,
      "add-point": false, // a tap sends it
      "finish-measuring": true,
      "set-measurements": false, // the panel's list sends it
      "move-lamp": false, // a drag sends it
      dismiss: true,
      "keep-views": false, // commands send it
      restore: false, // the commands undo and redo send it
      notify: false, // the viewer sends it
    };
    for (const [type, isWanted] of Object.entries(wanted)) {
      expect(actions.has(type as Action["type"]), type).toBe(isWanted);
    }
    const ofParts = PARTS.flatMap(({ settings }) => Object.keys(settings?.actions ?? {}));
    expect([...actions]).toEqual(expect.arrayContaining(ofParts));
    const commands = [...OWN_COMMANDS, ...PARTS.flatMap(({ commands: ofPart = [] }) => ofPart)];
    const asked = requests.filter((request) => typeof request === "string");
    expect(new Set(asked)).toEqual(new Set(commands));
  });

  it("reach every parameter; three keys reach the numbers of light and stereo", () => {
    const requests = allRequests();
    const set = new Set(
      requests.flatMap((request) =>
        request !== null && typeof request !== "string" && "id" in request ? [request.id] : [],
      ),
    );
    const turned = new Set<string>(
      [...LIGHT_NUMBERS, ...STEREO_NUMBERS, ...rowsOfParts().filter(isTurned)].map(({ id }) => id),
    );
    // only the panel sets the tone map and the colours of lamps
    const others = allParameters().filter(
      ({ id, kind }) => !turned.has(id) && kind !== "colour" && id !== "trace-tone-map",
    );
    for (const { id } of [...others, ...CHANNEL]) expect(set, id).toContain(id);
  });

  it("reach the state of the panel, except for typed texts and open sections", () => {
    const requests = allRequests();
    const changes = new Set(
      requests.flatMap((request) =>
        request !== null && typeof request !== "string" && "panel" in request
          ? [request.panel]
          : [],
      ),
    );
    const wanted: Readonly<Record<PanelChange["panel"], boolean>> = {
      page: true,
      pick: true,
      "clip-part": true,
      parameter: true,
      histogram: true,
      shape: true,
      "shape-number": true,
      lenses: true,
      hide: true,
      help: true,
      reveal: false,
      find: false,
      code: false,
      letters: false, // a key could not switch it on again
      keys: false, // the list of keys sends it
      unfold: false,
    };
    for (const [panel, isWanted] of Object.entries(wanted)) {
      expect(changes.has(panel as PanelChange["panel"]), panel).toBe(isWanted);
    }
  });

  it("move the chosen part of the cuts", () => {
    expect(KEYS.requestOf("N", CONTEXT)).toEqual({ panel: "clip-part", clipPart: "x-min" });
    expect(KEYS.requestOf("B", CONTEXT)).toEqual({ panel: "clip-part", clipPart: "z-max" });
    const { min, max } = SPECIMEN_BOX;
    const cut = (box: typeof SPECIMEN_BOX | object) => ({
      type: "set-clip",
      clip: { box, plane: null },
    });
    expect(KEYS.requestOf(".", CONTEXT)).toEqual(cut({ min: [1, min[1], min[2]], max }));
    const view = { ...START_VIEW, clipPart: "y-max" } as const;
    const inside = KEYS.requestOf(",", { ...CONTEXT, view });
    expect(inside).toEqual(cut({ min, max: [max[0], -0.4, max[2]] }));
    expect(KEYS.requestOf(".", { ...CONTEXT, view })).toEqual(REFUSED); // the specimen ends there
    const whole = reduce(CONTEXT.state, { type: "set-clip", clip: { box: null, plane: null } });
    expect(KEYS.requestOf(".", { ...CONTEXT, state: whole })).toEqual(REFUSED);
    expect(KEYS.requestOf("N", { ...CONTEXT, state: whole })).toEqual(REFUSED);
  });

  it("change the channel with the open card, or the first shown one", () => {
    expect(KEYS.requestOf("o", CONTEXT)).toEqual({
      type: "set",
      id: "opacity",
      channel: "c0",
      value: 0.95,
    });
    const view = { ...START_VIEW, picked: "c2" };
    expect(KEYS.requestOf("o", { ...CONTEXT, view })).toEqual({
      type: "set",
      id: "opacity",
      channel: "c2",
      value: 0.95,
    });
    expect(KEYS.requestOf("c", { ...CONTEXT, view })).toEqual({ panel: "pick", channel: "c3" });
    expect(KEYS.requestOf("C", { ...CONTEXT, view: { ...view, picked: "c0" } })).toEqual({
      panel: "pick",
      channel: "c3",
    });
  });

  it("show the lamps only if they light something", () => {
    expect(KEYS.requestOf("$", CONTEXT)).toEqual({ type: "set", id: "trace/lamps", value: true });
    const shown = reduce(CONTEXT.state, { type: "set", id: "trace/lamps", value: true });
    expect(KEYS.requestOf("$", { ...CONTEXT, state: shown })).toEqual({
      type: "set",
      id: "trace/lamps",
      value: false,
    });
    const marched = reduce(shown, { type: "set", id: "mode", value: "all" });
    expect(KEYS.requestOf("$", { ...CONTEXT, state: marched })).toEqual(REFUSED);
  });

  it("have no effect if there is nothing to change", () => {
    expect(KEYS.requestOf("F9", CONTEXT)).toBeNull();
    expect(KEYS.requestOf("F12", CONTEXT)).toBeNull();
    expect(KEYS.requestOf("g", { ...CONTEXT, focusTile: null })).toEqual(REFUSED);
  });

  it("change the state, or report why they do not", () => {
    const start = initialState(sampleManifest(1));
    const view = { ...START_VIEW, parameter: "slice-x" };
    const bare: KeyContext = { state: start, view, shown: SPECIMEN_BOX, focusTile: null };
    const dark = reduce(start, { type: "show", channel: "c0", shown: false });
    const atEnd = [
      { type: "set", id: "slice-planes", value: true } as const,
      { type: "set", id: "slice-x", value: 1 } as const,
      { type: "set", id: "disc-radius", value: 40 } as const,
      { type: "set", id: "switch-distance", value: 10 } as const,
    ].reduce(reduce, start);
    const contexts = {
      traced: CONTEXT,
      marched: MARCHED,
      bare,
      dark: { ...bare, state: dark },
      atEnd: { ...bare, state: atEnd },
    };
    const silent: string[] = [];
    for (const [where, context] of Object.entries(contexts)) {
      for (const name of ALL.flatMap(({ keys }) => keys)) {
        const request = KEYS.requestOf(name, context);
        if (request === null) throw new Error(name);
        if (isRefusal(request)) {
          if (!/^[A-Z].*\.$/.test(request.refusal))
            silent.push(`${where} ${name}: ${request.refusal}`);
          continue;
        }
        if (typeof request === "string" || "panel" in request) continue; // requests of the page have a test of their own
        const after = reduce(context.state, request);
        const text = spokenFeedback(request, context.state, after, new Map());
        const isSame = JSON.stringify(after) === JSON.stringify(context.state);
        const isAnnounced =
          "value" in request && typeof request.value !== "number"
            ? text !== ""
            : /: (at its limit|already so|the only one)$|^Slices: centred/.test(text);
        if (isSame && !isAnnounced) {
          silent.push(`${where} ${name}: ${text}`);
        }
      }
    }
    expect(silent).toEqual([]);
    expect(KEYS.requestOf("}", contexts.bare)).toEqual({ refusal: NO_SLICES });
    const announced = (name: string) => {
      const request = KEYS.requestOf(name, contexts.atEnd);
      if (request === null || isRefusal(request)) throw new Error(name);
      return spokenFeedback(request, atEnd, atEnd, new Map());
    };
    expect(announced("}")).toBe("Slices: x 100.0 %: at its limit");
    expect(announced("D")).toBe("Focus disc 40°: at its limit");
  });

  it("go to the next tile, also while one is isolated", () => {
    expect(KEYS.requestOf("t", CONTEXT)).toEqual({ type: "select", tile: "r0_c0" });
    const state = reduce(CONTEXT.state, { type: "isolate", tile: "r1_c4" });
    expect(KEYS.requestOf("t", { ...CONTEXT, state })).toEqual({ type: "isolate", tile: "r0_c0" });
    expect(KEYS.requestOf("i", { ...CONTEXT, state })).toEqual({ type: "isolate", tile: null });
  });

  it("cut the shown box, also that of an isolated tile", () => {
    const shown = { min: [0, -10, 0], max: [10, 0, 8] } as const;
    const state = initialState(sampleManifest(1));
    const clipOf = (name: string) => KEYS.requestOf(name, { ...CONTEXT, state, shown });
    expect(clipOf("b")).toMatchObject({
      clip: { box: { min: [2.5, -7.5, 2], max: [7.5, -2.5, 6] } },
    });
    expect(clipOf("n")).toMatchObject({ clip: { plane: { normal: [0, 0, 1], offset_um: 4 } } });
  });

  it("are announced in words that name the new value", () => {
    const ranges = new Map([["c0", [100, 1120] as const]]);
    const after = (name: string) => {
      const request = KEYS.requestOf(name, MARCHED);
      if (
        request === null ||
        typeof request === "string" ||
        "panel" in request ||
        isRefusal(request)
      ) {
        throw new Error(name);
      }
      return spokenFeedback(request, MARCHED.state, reduce(MARCHED.state, request), ranges);
    };
    expect(after("o")).toBe("Marker 0: opacity 95 %");
    expect(after("e")).toBe("Marker 0: window 100 – 1104");
    expect(after("1")).toBe("Marker 0: hidden");
    expect(after("D")).toBe("Focus disc 17°");
    expect(after("b")).toBe("Not cut");
    expect(after("n")).toBe("Cut by a box and a plane");
    expect(after(".")).toBe("Box: x from 1.00 µm");
  });

  it("for volumes report why they have no effect on a specimen of objects", () => {
    const channels = MARCHED.state.channels.map((one) => ({ ...one, hasObjects: true }));
    const objects = { ...MARCHED, state: { ...MARCHED.state, channels } };
    for (const name of ["m", "D", "%"]) {
      expect(KEYS.requestOf(name, objects)).toEqual({
        refusal: REASONS.volumes,
      });
      expect(KEYS.requestOf(name, MARCHED)).not.toHaveProperty("refusal");
    }
    expect(KEYS.requestOf("b", objects)).not.toHaveProperty("refusal");
  });
});
