import { describe, expect, it } from "vitest";
import { PARTS } from "../../test/support/all_parts";
import { SPECIMEN_BOX, sampleManifest } from "../../test/support/fixture/manifest";
import { initialState } from "../state/initial_state";
import { allParameters } from "../state/parameters/table";
import { reduce } from "../state/reduce";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import { controlsOf } from "./control_templates";
import { offerFor, type WaysOn } from "./ways_on";

const OF_PARTS: WaysOn = Object.assign({}, ...PARTS.map(({ waysOn }) => waysOn));
const start = initialState(sampleManifest(3));
const NOW = { state: start, shown: SPECIMEN_BOX, objects: new Map([["c0", [1, 2]]]) };

const STATES: readonly ViewerState[] = (["disc", "tile", "all", "traced", "off"] as const).map(
  (mode) => ({ ...start, mode, compositing: "maximum" }),
);

/** The state that a refusal's button leads to. */
function led(state: ViewerState, refusal: string): ViewerState {
  const to = offerFor(refusal, { ...NOW, state }, OF_PARTS)?.to ?? [];
  return to.reduce<ViewerState>(
    (now, each) => (typeof each === "string" ? now : reduce(now, each)),
    state,
  );
}

describe("a refusal", () => {
  it("is a sentence that a person can act on", () => {
    const ofParts = Object.keys(OF_PARTS);
    for (const text of [...Object.values(REFUSED), ...ofParts])
      expect(text).toMatch(/^[A-Z].{10,}\.$/);
  });

  it("of a setting has a button, which after a few presses makes the setting work", () => {
    const refused = STATES.flatMap((state) =>
      controlsOf(allParameters(), state).flatMap(({ id, refusal }) =>
        refusal ? [{ state, id, refusal }] : [],
      ),
    );
    expect(refused.length).toBeGreaterThan(20);
    const ofLamps = /^lamp/; // which are switched on one by one
    for (const { state, id, refusal } of refused.filter((each) => !ofLamps.test(each.id))) {
      let now = state;
      let reason: string | undefined = refusal;
      for (let i = 0; i < 3 && reason; i++) {
        now = led(now, reason);
        reason = controlsOf(allParameters(), now).find((each) => each.id === id)?.refusal;
      }
      expect(reason ?? "", `${id}: ${refusal}`).toBe("");
    }
  });

  it("for want of a tile, a cut or selected objects has a button, too", () => {
    expect(led(start, REFUSED.tile).isolated).toBe(start.middle);
    expect(led(start, REFUSED.cut).clip.plane).not.toBeNull();
    expect(led(start, REFUSED.objects).objects.c0.selected).toEqual([1, 2]);
    expect(offerFor("Something else.", NOW)).toBeNull();
  });

  it("has the button of the part that refuses, if there is such a part", () => {
    const ofParts = { [REFUSED.views]: () => ({ label: "Undo", to: ["undo"] }) as const };
    expect(offerFor(REFUSED.views, NOW, ofParts)?.to).toEqual(["undo"]);
    expect(offerFor(REFUSED.views, NOW)).toBeNull();
  });
});
