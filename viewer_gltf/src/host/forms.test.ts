import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Vec3 } from "../math/vec3";
import { initialState } from "../state/initial_state";
import type { Form } from "./form";
import { Forms } from "./forms";

const MANIFEST = sampleManifest(2);
const OPENING = initialState(MANIFEST);
/** The two channels are shown and have surfaces. A channel without a surface would fill the whole specimen. */
const STATE = {
  ...OPENING,
  channels: OPENING.channels.map((each) => ({ ...each, shown: true, hasSurface: true })),
};
const formsOf = (...forms: readonly Form[]) => new Forms({ forms }, MANIFEST);
const progress = (done: number, total: number) => ({
  overview: { done, total, isComplete: done === total },
});

describe("the forms of a specimen", () => {
  it("have an overview once each form has its own, and report that once", () => {
    expect(formsOf(progress(1, 2), {}).hasJustBegun()).toBe(false);
    const whole = formsOf(progress(2, 2), {}, progress(3, 3));
    expect(whole.overview).toEqual({ done: 5, total: 5, isComplete: true });
    expect([whole.hasJustBegun(), whole.hasJustBegun()]).toEqual([true, false]);
    expect(whole.hasOverview).toBe(true);
  });

  it("are complete if there are none", () => {
    const none = formsOf();
    expect([none.overview.isComplete, none.isIncomplete, none.marched]).toEqual([
      true,
      false,
      null,
    ]);
    expect(none.shownVolumes).toEqual([]);
    expect(none.shownPoints(STATE)).toEqual([]);
  });

  it("have the outline of each channel's own form, and none until it is known", () => {
    const point: Vec3 = [1, -2, 3];
    const [first] = STATE.channels;
    const ofFirst: Form = { outline: (_, { id }) => (id === first.id ? [point] : undefined) };
    const late: Form = { outline: () => null };
    expect(formsOf(ofFirst, { outline: () => [point] }).shownPoints(STATE)).toContainEqual(point);
    expect(formsOf(ofFirst, late).shownPoints(STATE)).toBeNull();
  });

  it("fill the box for a channel without a surface, but have the outline of its volume during the build", () => {
    const point: Vec3 = [1, -2, 3];
    const channels = STATE.channels.map((each) => ({ ...each, hasSurface: false }));
    const built = { ...STATE, channels };
    const form: Form = { outline: () => [point] };
    expect(formsOf(form).shownPoints(built)).not.toContainEqual(point);
    const tiles = STATE.tiles.map((tile) => ({ ...tile, isUnfinished: true as const }));
    const [only, ...others] = formsOf(form).shownPoints({ ...built, tiles }) ?? [];
    expect(only).toEqual(point);
    expect(others.every((each) => `${each}` === `${point}`)).toBe(true);
  });

  it("advance all fades, also after one that has not ended", () => {
    let count = 0;
    const fading = (isFading: boolean): Form => ({
      fade: () => {
        count++;
        return isFading;
      },
    });
    expect(formsOf(fading(true), fading(false)).fade(0.1)).toBe(true);
    expect(count).toBe(2);
  });
});
