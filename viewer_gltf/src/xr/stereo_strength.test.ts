import { PerspectiveCamera, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { spreadEyes } from "./stereo_strength";

function eyes() {
  return [-0.03, 0.03].map((x) => {
    const camera = new PerspectiveCamera();
    camera.matrix.makeTranslation(1 + x, 1.6, 2);
    return camera;
  });
}
const places = (cameras: PerspectiveCamera[]) =>
  cameras.map(({ matrix }) => Number(new Vector3().setFromMatrixPosition(matrix).x.toFixed(6)));

describe("the strength of stereo", () => {
  it("spreads a headset's eyes about their middle", () => {
    for (const [strength, expected] of [
      [1, [0.97, 1.03]],
      [0, [1, 1]],
      [2, [0.94, 1.06]],
    ] as const) {
      const cameras = eyes();
      spreadEyes(cameras, strength);
      expect(places(cameras)).toEqual(expected);
    }
  });

  it("does not move a single eye", () => {
    const [camera] = eyes();
    spreadEyes([camera], 0);
    expect(places([camera])).toEqual([0.97]);
  });
});
