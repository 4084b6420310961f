import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { faultOf, MAX_SHAPES, type Shape } from "../bundle/transfer_2d";
import type { Action } from "./actions";
import { initialState } from "./initial_state";
import { reduce } from "./reduce";
import { editedName, isTwoD, OWN, STEPS, shapesOf } from "./transfer_functions_2d";
import { MIN_HEIGHT, MIN_WIDTH, makeShape } from "./transfer_shapes";
import type { ChannelState } from "./viewer_state";

const SHAPE = makeShape("triangle", { value: 0.5, gradient: 0.4 });

/** The first channel after some actions; its function `soft` is 2D in the bundle. */
function channelAfter(...actions: readonly Action[]): ChannelState {
  const [first, ...others] = sampleManifest(2).channels;
  const names = { ...first.transfer_functions_2d, names: ["soft"] };
  const channels = [{ ...first, transfer_functions_2d: names }, ...others] as const;
  const start = initialState({ ...sampleManifest(2), channels: [...channels] });
  return actions.reduce(reduce, start).channels[0];
}

const choose = (name: string): Action => ({
  type: "choose-transfer-function",
  channel: "c0",
  name,
});
const set = (name: string, shapes: readonly Shape[]): Action => ({
  type: "set-shapes",
  channel: "c0",
  name,
  shapes,
});
const LEARN: Action = {
  type: "learn-transfer-2d",
  channel: "c0",
  transfer2d: { gradient_max: 0.4, functions: { soft: [SHAPE] } },
};

describe("the two-dimensional functions of a channel", () => {
  it("are the bundle's until they are edited", () => {
    expect(isTwoD(channelAfter())).toBe(false);
    const unknown = channelAfter(choose("soft"));
    expect([isTwoD(unknown), shapesOf(unknown)]).toEqual([true, []]);
    expect(shapesOf(channelAfter(choose("soft"), LEARN))).toEqual([SHAPE]);
    const edited = channelAfter(choose("soft"), LEARN, set("soft", [SHAPE, SHAPE]));
    expect(shapesOf(edited)).toHaveLength(2);
    const emptied = channelAfter(LEARN, set("soft", []));
    expect([isTwoD(emptied), emptied.transferFunction]).toEqual([false, "soft"]);
  });

  it("become the user's own function if the chosen one is one-dimensional, which stays unchanged", () => {
    expect(editedName(channelAfter())).toBe(OWN);
    expect(editedName(channelAfter(choose("soft")))).toBe("soft");
    const own = channelAfter(set(OWN, [SHAPE]));
    expect(own.transferFunction).toBe(OWN);
    expect(own.transferFunctions).toEqual(["default", "soft", OWN]);
    expect(isTwoD(own, "default")).toBe(false);
    const back = channelAfter(set(OWN, [SHAPE]), choose("default"), choose(OWN));
    expect(shapesOf(back)).toHaveLength(1);
    expect(channelAfter(set("none", [SHAPE]))).toEqual(channelAfter());
  });

  it("stay within the limits, for shapes from any source", () => {
    const wrong = [
      { ...SHAPE, opacity: Number.NaN },
      { ...SHAPE, values: [0.5, 0.4] as const },
      { ...SHAPE, gradients: [0.5, 1.5] as const },
    ];
    expect(shapesOf(channelAfter(set(OWN, [...wrong, SHAPE])))).toHaveLength(1);
    const many = Array.from({ length: MAX_SHAPES + 9 }, () => SHAPE);
    expect(shapesOf(channelAfter(set(OWN, many)))).toHaveLength(MAX_SHAPES);
  });

  it("lie on a lattice and stay valid shapes, however thin they are", () => {
    const [v, g] = [MIN_WIDTH, MIN_HEIGHT];
    const thin = [0, 0.12345, 1 - v, 0.9999 - v].flatMap((low) =>
      [0, 0.54321, 1 - g].map((bottom) => ({
        ...SHAPE,
        values: [low, low + v] as const,
        gradients: [bottom, bottom + g] as const,
        tip: 0.777777,
        opacity: 0.123456,
      })),
    );
    const kept = shapesOf(channelAfter(set(OWN, thin)));
    expect(kept).toHaveLength(thin.length);
    for (const shape of kept) {
      expect(faultOf(shape)).toBeNull();
      expect(shape.values[1] - shape.values[0]).toBeGreaterThan(v - 1e-9);
      expect(shape.gradients[1] - shape.gradients[0]).toBeGreaterThan(g - 1e-9);
      for (const number of [...shape.values, ...shape.gradients, shape.tip, shape.opacity]) {
        expect(number * STEPS).toBeCloseTo(Math.round(number * STEPS), 9);
      }
    }
    expect(shapesOf(channelAfter(set(OWN, kept)))).toEqual(kept); // shapes on the lattice stay the same
  });
});
