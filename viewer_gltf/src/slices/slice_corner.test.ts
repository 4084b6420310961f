import { describe, expect, it } from "vitest";
import { isKept } from "../math/clip";
import type { Vec3 } from "../math/vec3";
import { cornerTowards } from "./slice_corner";
import { sliceFrames } from "./slice_frame";

const BOX = { min: [0, -20, 10], max: [40, 0, 20] } as const;
const STRAIGHT: Vec3 = [0, 0, 0];

describe("slices", () => {
  it("cut away the corner that faces the eye, and keep it while the eye is very near to a slice", () => {
    const frames = sliceFrames({ point: [20, -10, 15], turn_deg: STRAIGHT }, BOX, null);
    const clip = (eye: Vec3, before: ReturnType<typeof cornerTowards> = []) => ({
      box: null,
      plane: null,
      corner: cornerTowards(eye, frames, before),
    });
    const all: Vec3[] = [-1, 1].flatMap((x) =>
      [-1, 1].flatMap((y) => [-1, 1].map((z): Vec3 => [20 + 9 * x, -10 + 9 * y, 15 + 4 * z])),
    );
    for (const eye of all) {
      expect(all.filter((p) => !isKept(p, clip(eye)))).toEqual([eye]);
      expect(isKept([20, eye[1], eye[2]], clip(eye))).toBe(true); // this point lies on a slice
    }
    const [nearly, past, far]: Vec3[] = [
      [20.1, -1, 19],
      [19.9, -1, 19],
      [19, -1, 19],
    ];
    const before = cornerTowards(nearly, frames, []);
    expect(isKept(all[7], clip(past, before))).toBe(false);
    expect(isKept(all[7], clip(far, before))).toBe(true);
  });
});
