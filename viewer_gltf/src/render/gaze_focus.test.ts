import { Matrix4 } from "three";
import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { initialState } from "../state/initial_state";
import { GazeFocus } from "./gaze_focus";

describe("the disc", () => {
  const manifest = sampleManifest(1);
  const state = { ...initialState(manifest), mode: "disc" as const, switchDistance_m: 1000 };
  const radius_rad = (state.discRadius_deg * Math.PI) / 180;
  // The gaze is above the first tile. The next tile lies within the disc, but not within half of
  // its radius.
  const { min, max } = manifest.tiles[0].bounds_um;
  const AWAY = 4;
  const x = max[0] - 0.75 * AWAY * Math.tan(radius_rad);
  const head = new Matrix4().makeTranslation(x, (min[1] + max[1]) / 2, max[2] + AWAY);
  const standing = () => {
    const gazeFocus = new GazeFocus(manifest);
    const look = () => gazeFocus.look(state, head, new Matrix4(), () => true, 0.1);
    for (let i = 0; i < 10; i++) look();
    return { gazeFocus, look };
  };

  it("opens as far as the setting and the frame's budget allow", () => {
    const { gazeFocus, look } = standing();
    const whole = gazeFocus.outer_rad;
    expect(whole).toBeCloseTo(radius_rad, 6);
    gazeFocus.radiusShare = 0.5;
    look();
    expect(gazeFocus.outer_rad).toBeCloseTo(whole / 2, 6);
  });

  it("comes to rest: the budget of a moving view and that of a resting view want the same tiles", () => {
    const { gazeFocus, look } = standing();
    const { disc } = gazeFocus.focusTiles;
    expect(disc).toEqual(["r0_c0", "r0_c1"]);
    for (const share of [0.5, 1, 0.5, 1]) {
      gazeFocus.radiusShare = share;
      expect(look()).toBe(false);
      expect(gazeFocus.focusTiles.disc).toEqual(disc);
      expect(gazeFocus.mayRefine).toBe(true);
      // otherwise the resting view would change, its budget would narrow the disc, and so on
      // forever
      expect(gazeFocus.isChanging(state)).toBe(false);
    }
  });
});
