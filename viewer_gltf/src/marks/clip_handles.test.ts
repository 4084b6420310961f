import { describe, expect, it } from "vitest";
import type { Box } from "../math/box";
import type { Clip } from "../math/clip";
import type { Ray } from "../math/vec3";
import {
  armOf,
  boxWithin,
  dragHandle,
  handlesOf,
  markedClip,
  pickHandle,
  TOLERANCE_RAD,
} from "./clip_handles";

const SPECIMEN: Box = { min: [0, -400, 0], max: [1000, 0, 200] };
const BOX: Box = { min: [100, -300, 50], max: [900, -100, 150] };
const CLIP: Clip = { box: BOX, plane: { normal: [0, 0, 1], offset_um: 120 } };

describe("the handles", () => {
  it("do not exist if nothing is cut", () => {
    expect(handlesOf({ box: null, plane: null }, SPECIMEN)).toEqual([]);
  });

  it("lie at the centres of the box's faces, on the plane and in front of it", () => {
    const at = new Map(handlesOf(CLIP, SPECIMEN).map(({ id, position }) => [id, position]));
    expect(at.size).toBe(8);
    expect(at.get("x-min")).toEqual([100, -200, 100]);
    expect(at.get("x-max")).toEqual([900, -200, 100]);
    expect(at.get("y-max")).toEqual([500, -100, 100]);
    expect(at.get("plane-middle")).toEqual([500, -200, 120]);
    expect(at.get("plane-tip")).toEqual([500, -200, 120 + armOf(SPECIMEN)]);
  });

  it("lie on the isolated tile, even if the box is larger", () => {
    const tile: Box = { min: [500, -400, 0], max: [1000, 0, 200] };
    const at = new Map(handlesOf({ box: BOX, plane: null }, tile).map((h) => [h.id, h.position]));
    expect(at.get("x-min")).toEqual([500, -200, 100]);
    expect(at.get("x-max")).toEqual([900, -200, 100]);
    expect(at.get("y-min")).toEqual([700, -300, 100]);
  });

  it("are not moved to an isolated tile that the box does not overlap", () => {
    const beside: Box = { min: [950, -400, 0], max: [1000, 0, 200] };
    expect(boxWithin(BOX, beside)).toBe(BOX);
  });
});

describe("the marks of the cut that a page opens with", () => {
  it("are hidden until a user points at the view", () => {
    const nothing = markedClip(CLIP, CLIP, false);
    expect(handlesOf(nothing, SPECIMEN)).toEqual([]);
    expect(markedClip(CLIP, CLIP, true)).toBe(CLIP);
  });

  it("show at once after the cut was moved", () => {
    const moved: Clip = { ...CLIP, box: null };
    expect(markedClip(moved, CLIP, false)).toBe(moved);
  });
});

describe("the handle at which a ray points", () => {
  /** A ray that passes the handle z-max at an angle, from 1000 um in front of it. */
  const rayAt = (angle: number): Ray => ({
    origin: [500, -200, 1150],
    direction: [Math.sin(angle), 0, -Math.cos(angle)],
  });
  const handles = handlesOf({ box: BOX, plane: null }, SPECIMEN);

  it("is the one within the pointer's tolerance, at any distance", () => {
    for (const tolerance of Object.values(TOLERANCE_RAD)) {
      expect(pickHandle(rayAt(0.99 * tolerance), handles, tolerance)).toBe("z-max");
      expect(pickHandle(rayAt(1.01 * tolerance), handles, tolerance)).toBeNull();
    }
    expect(TOLERANCE_RAD.gaze).toBeGreaterThan(TOLERANCE_RAD.mouse);
  });

  it("is not behind the eye", () => {
    const away: Ray = { origin: [500, -200, 1150], direction: [0, 0, 3] };
    expect(pickHandle(away, handles, 0.5)).toBeNull();
  });

  it("is the one at the smaller angle", () => {
    const ray: Ray = { origin: [500, -200, 5000], direction: [0, 0.1, -5000] };
    expect(pickHandle(ray, handles, 1)).toBe("z-max");
  });
});

describe("a drag", () => {
  const atX = (x: number): Ray => ({ origin: [x, -200, 3000], direction: [0, 0, -2] });

  it("moves only the dragged face to the ray", () => {
    expect(dragHandle("x-min", atX(321), CLIP, SPECIMEN)).toEqual({
      type: "set-clip",
      clip: { box: { ...BOX, min: [321, -300, 50] }, plane: CLIP.plane },
    });
    expect(dragHandle("x-max", atX(700), CLIP, SPECIMEN)).toEqual({
      type: "set-clip",
      clip: { box: { ...BOX, max: [700, -100, 150] }, plane: CLIP.plane },
    });
  });

  it("leaves faces beyond the isolated tile where they are", () => {
    const tile: Box = { min: [0, -400, 0], max: [500, 0, 200] };
    const action = dragHandle("x-min", atX(200), { box: BOX, plane: null }, tile);
    expect(action).toEqual({
      type: "set-clip",
      clip: { box: { min: [200, -300, 50], max: BOX.max }, plane: null },
    });
  });

  it("moves the plane along its normal, and turns it", () => {
    const along: Ray = { origin: [500, 3000, 80], direction: [0, -1, 0] };
    expect(dragHandle("plane-middle", along, CLIP, SPECIMEN)).toEqual({
      type: "set-clip",
      clip: { box: BOX, plane: { normal: [0, 0, 1], offset_um: 80 } },
    });
    const aside: Ray = { origin: [500 + 900, -200, 120], direction: [-1, 0, 0] };
    const turned = dragHandle("plane-tip", aside, CLIP, SPECIMEN);
    if (turned?.type !== "set-clip") throw new Error("no drag");
    [1, 0, 0].forEach((v, i) => {
      expect(turned.clip.plane?.normal[i]).toBeCloseTo(v);
    });
    expect(turned.clip.plane?.offset_um).toBeCloseTo(500);
  });

  it("does nothing for a handle that does not exist, or along the ray", () => {
    expect(dragHandle("x-min", atX(0), { box: null, plane: null }, SPECIMEN)).toBeNull();
    expect(dragHandle("plane-tip", atX(0), { box: BOX, plane: null }, SPECIMEN)).toBeNull();
    expect(dragHandle("z-max", atX(500), CLIP, SPECIMEN)).toBeNull();
  });
});
