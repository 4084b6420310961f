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

/** A number without keys of its own: one key chooses among several of them, two turn the chosen one. */
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
    { type: "notify", text: "a fault", isMendable: true } as const,
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

/** The same where volumes are marched, slices show and a tap measures. */
const MARCHED: KeyContext = {
  ...CONTEXT,
  state: [
    { type: "set", id: "mode", value: "disc" } as const,
    { type: "set", id: "slice-pictures", value: true } as const,
    { type: "set", id: "tool", value: "measure" } as const,
    { type: "select", tile: "r0_c2" } as const,
  ].reduce<KeyContext["state"]>(reduce, CONTEXT.state),
};
/** The same where nothing but volumes shows. */
const EVERYWHERE: KeyContext = {
  ...MARCHED,
  state: reduce(MARCHED.state, { type: "set", id: "mode", value: "all" } as const),
};
const CONTEXTS = [CONTEXT, MARCHED, EVERYWHERE];

/** What every key asks for where it does something. */
const allWishes = () =>
  CONTEXTS.flatMap((context) =>
    ALL.flatMap(({ to, keys }) => keys.map((name) => to(context, name))),
  ).filter((answer) => !isRefusal(answer));

const REFUSED = { refusal: expect.stringMatching(/^[A-Z].*\.$/) };

describe("the keys", () => {
  it("mean one thing each, and name it", () => {
    const names = ALL.flatMap(({ keys }) => keys);
    expect(new Set(names).size).toBe(names.length);
    expect(ALL.filter(({ label }) => label.length < 3)).toEqual([]);
  });

  it("reach every action and every command", () => {
    const wishes = allWishes();
    const actions = new Set(
      wishes.flatMap((wish) =>
        wish !== null && typeof wish !== "string" && "type" in wish ? [wish.type] : [],
      ),
    );
    const wanted: Readonly<Record<Exclude<Action, PartAction>["type"], boolean>> = {
      set: true,
      objects: false, // the panel's, and a tap
      show: true,
      window: true,
      "choose-transfer-function": true,
      "set-shapes": true,
      "learn-transfer-2d": false, // the bundle's
      select: true,
      isolate: true,
      "set-clip": true,
      measure: true,
      "add-point": false, // a tap
      "finish-measuring": true,
      "set-measurements": false, // the panel's list
      "move-lamp": false, // a drag
      dismiss: true,
      "keep-views": false, // by the commands
      restore: false, // by the commands undo and redo
      notify: false, // the viewer's own
    };
    for (const [type, isWanted] of Object.entries(wanted)) {
      expect(actions.has(type as Action["type"]), type).toBe(isWanted);
    }
    const ofParts = PARTS.flatMap(({ settings }) => Object.keys(settings?.actions ?? {}));
    expect([...actions]).toEqual(expect.arrayContaining(ofParts));
    const commands = [...OWN_COMMANDS, ...PARTS.flatMap(({ commands: ofPart = [] }) => ofPart)];
    const asked = wishes.filter((wish) => typeof wish === "string");
    expect(new Set(asked)).toEqual(new Set(commands));
  });

  it("reach every parameter, the light's and stereo's numbers by three keys", () => {
    const wishes = allWishes();
    const set = new Set(
      wishes.flatMap((wish) =>
        wish !== null && typeof wish !== "string" && "id" in wish ? [wish.id] : [],
      ),
    );
    const turned = new Set<string>(
      [...LIGHT_NUMBERS, ...STEREO_NUMBERS, ...rowsOfParts().filter(isTurned)].map(({ id }) => id),
    );
    // the choice of a tone map and lamps' colours are the panel's alone
    const others = allParameters().filter(
      ({ id, kind }) => !turned.has(id) && kind !== "colour" && id !== "trace-tone-map",
    );
    for (const { id } of [...others, ...CHANNEL]) expect(set, id).toContain(id);
  });

  it("reach what the panel keeps for itself, but for what is typed and what is folded", () => {
    const wishes = allWishes();
    const changes = new Set(
      wishes.flatMap((wish) =>
        wish !== null && typeof wish !== "string" && "panel" in wish ? [wish.panel] : [],
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
      letters: false, // a key could not switch it back on
      keys: false, // the list of keys has it
      unfold: false,
    };
    for (const [panel, isWanted] of Object.entries(wanted)) {
      expect(changes.has(panel as PanelChange["panel"]), panel).toBe(isWanted);
    }
  });

  it("move the part of the cuts that is meant", () => {
    expect(KEYS.wishOf("N", CONTEXT)).toEqual({ panel: "clip-part", clipPart: "x-min" });
    expect(KEYS.wishOf("B", CONTEXT)).toEqual({ panel: "clip-part", clipPart: "z-max" });
    const { min, max } = SPECIMEN_BOX;
    const cut = (box: typeof SPECIMEN_BOX | object) => ({
      type: "set-clip",
      clip: { box, plane: null },
    });
    expect(KEYS.wishOf(".", CONTEXT)).toEqual(cut({ min: [1, min[1], min[2]], max }));
    const view = { ...START_VIEW, clipPart: "y-max" } as const;
    const inside = KEYS.wishOf(",", { ...CONTEXT, view });
    expect(inside).toEqual(cut({ min, max: [max[0], -0.4, max[2]] }));
    expect(KEYS.wishOf(".", { ...CONTEXT, view })).toEqual(REFUSED); // there the specimen ends
    const whole = reduce(CONTEXT.state, { type: "set-clip", clip: { box: null, plane: null } });
    expect(KEYS.wishOf(".", { ...CONTEXT, state: whole })).toEqual(REFUSED);
    expect(KEYS.wishOf("N", { ...CONTEXT, state: whole })).toEqual(REFUSED);
  });

  it("mean the channel with the open card, or the first one shown", () => {
    expect(KEYS.wishOf("o", CONTEXT)).toEqual({
      type: "set",
      id: "opacity",
      channel: "c0",
      value: 0.95,
    });
    const view = { ...START_VIEW, picked: "c2" };
    expect(KEYS.wishOf("o", { ...CONTEXT, view })).toEqual({
      type: "set",
      id: "opacity",
      channel: "c2",
      value: 0.95,
    });
    expect(KEYS.wishOf("c", { ...CONTEXT, view })).toEqual({ panel: "pick", channel: "c3" });
    expect(KEYS.wishOf("C", { ...CONTEXT, view: { ...view, picked: "c0" } })).toEqual({
      panel: "pick",
      channel: "c3",
    });
  });

  it("show the lamps where they light something", () => {
    expect(KEYS.wishOf("$", CONTEXT)).toEqual({ type: "set", id: "trace/lamps", value: true });
    const shown = reduce(CONTEXT.state, { type: "set", id: "trace/lamps", value: true });
    expect(KEYS.wishOf("$", { ...CONTEXT, state: shown })).toEqual({
      type: "set",
      id: "trace/lamps",
      value: false,
    });
    const marched = reduce(shown, { type: "set", id: "mode", value: "all" });
    expect(KEYS.wishOf("$", { ...CONTEXT, state: marched })).toEqual(REFUSED);
  });

  it("do nothing where there is nothing to do", () => {
    expect(KEYS.wishOf("F9", CONTEXT)).toBeNull();
    expect(KEYS.wishOf("F12", CONTEXT)).toBeNull();
    expect(KEYS.wishOf("g", { ...CONTEXT, focusTile: null })).toEqual(REFUSED);
  });

  it("change the state, or say why they don't", () => {
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
        const wish = KEYS.wishOf(name, context);
        if (wish === null) throw new Error(name);
        if (isRefusal(wish)) {
          if (!/^[A-Z].*\.$/.test(wish.refusal)) silent.push(`${where} ${name}: ${wish.refusal}`);
          continue;
        }
        if (typeof wish === "string" || "panel" in wish) continue; // the page's: see its test
        const after = reduce(context.state, wish);
        const text = spokenFeedback(wish, context.state, after, new Map());
        const isSame = JSON.stringify(after) === JSON.stringify(context.state);
        const isSaid =
          "value" in wish && typeof wish.value !== "number"
            ? text !== ""
            : /: (it goes no further|the only one)$|^Slices: centred/.test(text);
        if (isSame && !isSaid) {
          silent.push(`${where} ${name}: ${text}`);
        }
      }
    }
    expect(silent).toEqual([]);
    expect(KEYS.wishOf("}", contexts.bare)).toEqual({ refusal: NO_SLICES });
    const said = (name: string) => {
      const wish = KEYS.wishOf(name, contexts.atEnd);
      if (wish === null || isRefusal(wish)) throw new Error(name);
      return spokenFeedback(wish, atEnd, atEnd, new Map());
    };
    expect(said("}")).toBe("Slices: x 100.0 %: it goes no further");
    expect(said("D")).toBe("Focus disc 40°: it goes no further");
  });

  it("go to the next tile, also of those that are shown alone", () => {
    expect(KEYS.wishOf("t", CONTEXT)).toEqual({ type: "select", tile: "r0_c0" });
    const state = reduce(CONTEXT.state, { type: "isolate", tile: "r1_c4" });
    expect(KEYS.wishOf("t", { ...CONTEXT, state })).toEqual({ type: "isolate", tile: "r0_c0" });
    expect(KEYS.wishOf("i", { ...CONTEXT, state })).toEqual({ type: "isolate", tile: null });
  });

  it("cut what is shown, also of a tile that is shown alone", () => {
    const shown = { min: [0, -10, 0], max: [10, 0, 8] } as const;
    const state = initialState(sampleManifest(1));
    const clipOf = (name: string) => KEYS.wishOf(name, { ...CONTEXT, state, shown });
    expect(clipOf("b")).toMatchObject({
      clip: { box: { min: [2.5, -7.5, 2], max: [7.5, -2.5, 6] } },
    });
    expect(clipOf("n")).toMatchObject({ clip: { plane: { normal: [0, 0, 1], offset_um: 4 } } });
  });

  it("are announced in words that name the new value", () => {
    const ranges = new Map([["c0", [100, 1120] as const]]);
    const after = (name: string) => {
      const wish = KEYS.wishOf(name, MARCHED);
      if (wish === null || typeof wish === "string" || "panel" in wish || isRefusal(wish)) {
        throw new Error(name);
      }
      return spokenFeedback(wish, MARCHED.state, reduce(MARCHED.state, wish), ranges);
    };
    expect(after("o")).toBe("Marker 0: opacity 95 %");
    expect(after("e")).toBe("Marker 0: window 100 – 1104");
    expect(after("1")).toBe("Marker 0: hidden");
    expect(after("D")).toBe("Focus disc 17°");
    expect(after("b")).toBe("Not cut");
    expect(after("n")).toBe("Cut by a box and a plane");
    expect(after(".")).toBe("Box: x from 1.00 µm");
  });

  it("of volumes say why they do nothing where there are only objects", () => {
    const channels = MARCHED.state.channels.map((one) => ({ ...one, hasObjects: true }));
    const objects = { ...MARCHED, state: { ...MARCHED.state, channels } };
    for (const name of ["m", "D", "%"]) {
      expect(KEYS.wishOf(name, objects)).toEqual({
        refusal: REASONS.volumes,
      });
      expect(KEYS.wishOf(name, MARCHED)).not.toHaveProperty("refusal");
    }
    expect(KEYS.wishOf("b", objects)).not.toHaveProperty("refusal");
  });
});
