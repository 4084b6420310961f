import { describe, expect, it } from "vitest";
import type { Box } from "../math/box";
import type { Clip } from "../math/clip";
import {
  type ClipPart,
  chosenClipPart,
  clipPartName,
  clipPartsOf,
  cutText,
  handleOf,
  moveClipPart,
} from "./clip_by_key";

const SHOWN: Box = { min: [0, -20, 0], max: [100, 0, 50] };
const CLIP: Clip = {
  box: { min: [10, -20, 10], max: [90, -5, 40] },
  plane: { normal: [0, 0, 1], offset_um: 25 },
};

function moved(clipPart: ClipPart, steps: number, clip = CLIP, shown = SHOWN): Clip {
  const action = moveClipPart(clipPart, steps, clip, shown);
  return action?.type === "set-clip" ? action.clip : clip;
}

describe("the parts of the cuts", () => {
  it("belong to the existing cuts, each with a unique name", () => {
    expect(clipPartsOf({ box: null, plane: null })).toEqual([]);
    expect(clipPartsOf({ ...CLIP, box: null })).toEqual([
      "plane-middle",
      "turn-x",
      "turn-y",
      "turn-z",
    ]);
    const all = clipPartsOf(CLIP);
    expect(new Set(all.map(clipPartName)).size).toBe(10);
    expect(handleOf("turn-y")).toBe("plane-tip");
  });

  it("stay chosen while they exist", () => {
    expect(chosenClipPart(CLIP, "y-max")).toBe("y-max");
    expect(chosenClipPart(CLIP, null)).toBe("x-min");
    expect(chosenClipPart({ ...CLIP, box: null }, "y-max")).toBe("plane-middle");
    expect(chosenClipPart({ box: null, plane: null }, "y-max")).toBeUndefined();
  });

  it("move one face by a fiftieth of the edge", () => {
    expect(moved("x-min", 1)).toEqual({ ...CLIP, box: { min: [12, -20, 10], max: [90, -5, 40] } });
    expect(moved("z-max", -2).box?.max[2]).toBeCloseTo(38);
  });

  it("move the plane along its normal", () => {
    expect(moved("plane-middle", -1).plane).toEqual({ normal: [0, 0, 1], offset_um: 23 });
  });

  it("turn the plane about its middle by five degrees, counter-clockwise", () => {
    const { plane } = moved("turn-y", 1);
    [Math.sin(Math.PI / 36), 0, Math.cos(Math.PI / 36)].forEach((v, i) => {
      expect(plane?.normal[i]).toBeCloseTo(v);
    });
    // the point (50, -10, 25) stays on the plane
    expect(plane?.offset_um).toBeCloseTo(50 * Math.sin(Math.PI / 36) + 25 * Math.cos(Math.PI / 36));
    expect(moved("turn-z", 1).plane?.normal).toEqual([0, 0, 1]);
  });

  it("stay within the limits of the handles", () => {
    const far = moved("x-min", 1000);
    expect(far.box?.min[0]).toBeCloseTo(89);
    expect(moveClipPart("x-min", 1, far, SHOWN)).toBeNull();
    expect(moved("plane-middle", 1000).plane?.offset_um).toBe(50);
    expect(moveClipPart("plane-middle", 1, moved("plane-middle", 1000), SHOWN)).toBeNull();
    expect(moveClipPart("x-min", 1, { ...CLIP, box: null }, SHOWN)).toBeNull();
  });

  it("move within the isolated tile", () => {
    const tile: Box = { min: [50, -20, 0], max: [100, 0, 50] };
    expect(moved("x-max", -1, CLIP, tile).box).toEqual({ min: [10, -20, 10], max: [89, -5, 40] });
    expect(moved("x-min", 1, CLIP, tile).box?.min[0]).toBe(51);
  });

  it("are announced with their new place", () => {
    expect(cutText(CLIP, moved("y-min", 1))).toBe("Box: y from -19.6 µm");
    expect(cutText(CLIP, moved("plane-middle", 1))).toBe("Plane at 27.0 µm");
    expect(cutText(CLIP, moved("turn-x", 6))).toBe("Plane faces 0, -0.5, 0.87");
    expect(cutText(CLIP, { ...CLIP, box: null })).toBe("Cut by a plane");
  });
});
