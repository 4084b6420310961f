import { describe, expect, it } from "vitest";
import { PARTS } from "../../test/support/all_parts";
import { SPECIMEN_BOX, sampleManifest } from "../../test/support/fixture/manifest";
import { initialState } from "../state/initial_state";
import { allParameters } from "../state/parameters/table";
import { reduce } from "../state/reduce";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import { controlsOf } from "./control_templates";
import { offerFor, type Remedies } from "./remedies";

const OF_PARTS: Remedies = Object.assign({}, ...PARTS.map(({ remedies }) => remedies));
const start = initialState(sampleManifest(3));
const NOW = { state: start, shown: SPECIMEN_BOX, objects: new Map([["c0", [1, 2]]]) };

const STATES: readonly ViewerState[] = (["disc", "tile", "all", "traced", "off"] as const).map(
  (mode) => ({ ...start, mode, compositing: "maximum" }),
);

/** The state after a press on the button of a refusal. */
function afterOffer(state: ViewerState, refusal: string): ViewerState {
  const to = offerFor(refusal, { ...NOW, state }, OF_PARTS)?.to ?? [];
  return to.reduce<ViewerState>(
    (now, each) => (typeof each === "string" ? now : reduce(now, each)),
    state,
  );
}

describe("a refusal", () => {
  it("is a sentence that a user can act on", () => {
    const ofParts = Object.keys(OF_PARTS);
    for (const text of [...Object.values(REFUSED), ...ofParts])
      expect(text).toMatch(/^[A-Z].{10,}\.$/);
  });

  it("has a button, which makes a setting work after a few presses", () => {
    const refused = STATES.flatMap((state) =>
      controlsOf(allParameters(), state).flatMap(({ id, refusal }) =>
        refusal ? [{ state, id, refusal }] : [],
      ),
    );
    expect(refused.length).toBeGreaterThan(20);
    const ofLamps = /^lamp/; // lamps are switched on one by one
    for (const { state, id, refusal } of refused.filter((each) => !ofLamps.test(each.id))) {
      let now = state;
      let reason: string | undefined = refusal;
      for (let i = 0; i < 3 && reason; i++) {
        now = afterOffer(now, reason);
        reason = controlsOf(allParameters(), now).find((each) => each.id === id)?.refusal;
      }
      expect(reason ?? "", `${id}: ${refusal}`).toBe("");
    }
  });

  it("has a button also if a tile, a cut or selected objects are missing", () => {
    expect(afterOffer(start, REFUSED.tile).isolated).toBe(start.middle);
    expect(afterOffer(start, REFUSED.cut).clip.plane).not.toBeNull();
    expect(afterOffer(start, REFUSED.objects).objects.c0.selected).toEqual([1, 2]);
    expect(offerFor("Something else.", NOW)).toBeNull();
  });

  it("has the button that its part defines, if any", () => {
    const ofParts = { [REFUSED.views]: () => ({ label: "Undo", to: ["undo"] }) as const };
    expect(offerFor(REFUSED.views, NOW, ofParts)?.to).toEqual(["undo"]);
    expect(offerFor(REFUSED.views, NOW)).toBeNull();
  });
});
