import { describe, expect, it } from "vitest";
import { SPECIMEN_BOX, sampleManifest } from "../../test/fixture/manifest";
import { type Action, initialState, reduce } from "../state";
import type { Command } from "./commands";
import { START_VIEW } from "./controls";
import { firesOn, KEYS, type KeyContext, wishOf } from "./keys";
import { told } from "./told";

const ALL = KEYS.flatMap(({ keys }) => keys);
const CONTEXT: KeyContext = {
  state: [
    { type: "measure", points: [[0, 0, 0]] } as const,
    { type: "notify", text: "a fault" } as const,
  ].reduce<KeyContext["state"]>(reduce, initialState(sampleManifest(6))),
  view: START_VIEW,
  specimen: SPECIMEN_BOX,
  gazed: "r0_c2",
};

describe("the keys", () => {
  it("mean one thing each, and say what", () => {
    const names = ALL.flatMap(({ keys }) => keys);
    expect(new Set(names).size).toBe(names.length);
    expect(ALL.filter(({ label }) => label.length < 3)).toEqual([]);
  });

  it("reach every action and every command", () => {
    const wishes = ALL.map(({ to, keys }) => to(CONTEXT, keys[0]));
    const actions = new Set(
      wishes.flatMap((wish) =>
        wish !== null && typeof wish !== "string" && "type" in wish ? [wish.type] : [],
      ),
    );
    const wanted: Readonly<Record<Action["type"], boolean>> = {
      show: true,
      recolor: true,
      fade: true,
      window: true,
      "draw-volume": true,
      "choose-transfer-function": true,
      select: true,
      isolate: true,
      "choose-mode": true,
      "set-switch-distance": true,
      "set-disc-radius": true,
      "set-clip": true,
      "choose-tool": true,
      measure: true,
      "set-dwell": true,
      "choose-quality": true,
      dismiss: true,
      notify: false, // the viewer's own
    };
    for (const [type, isWanted] of Object.entries(wanted)) {
      expect(actions.has(type as Action["type"]), type).toBe(isWanted);
    }
    const commands: Readonly<Record<Command, true>> = {
      reset: true,
      back: true,
      stereo: true,
      split: true,
      scan: true,
      share: true,
      press: true,
      front: true,
      side: true,
      top: true,
      "zoom-in": true,
      "zoom-out": true,
      "turn-left": true,
      "turn-right": true,
      "turn-up": true,
      "turn-down": true,
    };
    const asked = wishes.filter((wish) => typeof wish === "string");
    expect(new Set(asked)).toEqual(new Set(Object.keys(commands)));
  });

  it("mean the channel whose card is open, or the first one shown", () => {
    expect(wishOf("o", CONTEXT)).toEqual({ type: "fade", channel: "c0", opacity: 0.95 });
    const view = { ...START_VIEW, picked: "c2" };
    expect(wishOf("o", { ...CONTEXT, view })).toEqual({
      type: "fade",
      channel: "c2",
      opacity: 0.95,
    });
    expect(wishOf("c", { ...CONTEXT, view })).toEqual({ panel: "pick", channel: "c3" });
    expect(wishOf("C", { ...CONTEXT, view: { ...view, picked: "c0" } })).toEqual({
      panel: "pick",
      channel: "c3",
    });
  });

  it("do nothing where there is nothing to do", () => {
    expect(wishOf("9", CONTEXT)).toBeNull();
    expect(wishOf("F12", CONTEXT)).toBeNull();
    expect(wishOf("g", { ...CONTEXT, gazed: null })).toBeNull();
  });

  it("go to the next tile, also of those that are shown alone", () => {
    expect(wishOf("t", CONTEXT)).toEqual({ type: "select", tile: "r0_c0" });
    const state = reduce(CONTEXT.state, { type: "isolate", tile: "r1_c4" });
    expect(wishOf("t", { ...CONTEXT, state })).toEqual({ type: "isolate", tile: "r0_c0" });
    expect(wishOf("i", { ...CONTEXT, state })).toEqual({ type: "isolate", tile: null });
  });

  it("rest while something is typed, and leave a control its own", () => {
    for (const name of ["a", "?", "ArrowLeft", "Escape"]) {
      expect(firesOn(name, "field"), name).toBe(false);
      expect(firesOn(name, "page"), name).toBe(true);
    }
    for (const name of ["ArrowLeft", "Enter", " ", "Home", "+"]) {
      expect(firesOn(name, "control"), name).toBe(false);
    }
    expect(firesOn("o", "control")).toBe(true);
  });

  it("are told in words that name the new value", () => {
    const ranges = new Map([["c0", [100, 1120] as const]]);
    const after = (name: string) => {
      const wish = wishOf(name, CONTEXT);
      if (wish === null || typeof wish === "string" || "panel" in wish) throw new Error(name);
      return told(wish, reduce(CONTEXT.state, wish), ranges);
    };
    expect(after("o")).toBe("Marker 0: opacity 95 %");
    expect(after("e")).toBe("Marker 0: window 100 – 1104");
    expect(after("1")).toBe("Marker 0: hidden");
    expect(after("D")).toBe("Disc 13°");
    expect(after("b")).toBe("Cut by a box");
  });
});
