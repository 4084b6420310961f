import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import {
  bearingOf,
  extentOf,
  followHead,
  noticeBearing,
  openerPitch,
  placePanel,
  pointAt,
} from "./placement";

const DEG = Math.PI / 180;
const EYE = new Vector3(0.3, 1.6, -0.2);
const HALF = { yaw: 15 * DEG, pitch: 9.5 * DEG };

/** 27 points of a box, its middle 1.5 m before the eye. */
function boxAround(width: number, height: number, depth: number): Vector3[] {
  const ends = [-0.5, 0, 0.5];
  return ends.flatMap((x) =>
    ends.flatMap((y) =>
      ends.map((z) => new Vector3(x * width, y * height, z * depth - 1.5).add(EYE)),
    ),
  );
}

describe("the panel's place", () => {
  it("is beside the specimen, whatever its shape, and never before it", () => {
    for (const [w, h, d] of [
      [1.2, 0.48, 0.1],
      [1.2, 1.2, 0.2],
      [0.3, 1.2, 0.3],
      [1.2, 1.2, 1.2],
    ]) {
      const extent = extentOf(boxAround(w, h, d), EYE, 0);
      const { yaw, pitch } = placePanel(extent, HALF);
      const isBeside = yaw + HALF.yaw < extent.yaw[0] || yaw - HALF.yaw > extent.yaw[1];
      const isBelow = pitch + HALF.pitch < extent.pitch[0];
      expect(isBeside || isBelow, `${w} x ${h} x ${d}`).toBe(true);
      expect(Math.abs(yaw)).toBeLessThanOrEqual(62 * DEG);
      expect(pitch).toBeGreaterThanOrEqual(-35 * DEG);
    }
  });

  it("is below a flat specimen, to the left of a high one", () => {
    expect(placePanel(extentOf(boxAround(1.2, 0.48, 0.1), EYE, 0), HALF).yaw).toBeCloseTo(0, 6);
    expect(placePanel(extentOf(boxAround(1, 1.6, 0.1), EYE, 0), HALF).yaw).toBeLessThan(-30 * DEG);
  });

  it("comes back as the bearing that it was given", () => {
    const at = pointAt({ yaw: 0.7, pitch: -0.4 }, EYE, 1.2);
    expect(at.distanceTo(EYE)).toBeCloseTo(1.2, 12);
    const { yaw, pitch } = bearingOf(at.sub(EYE));
    expect([yaw, pitch]).toEqual([expect.closeTo(0.7, 12), expect.closeTo(-0.4, 12)]);
  });
});

describe("a notice", () => {
  it("is under the gaze, but for one at the floor", () => {
    expect(noticeBearing({ yaw: 1, pitch: 0.2 })).toEqual({
      yaw: 1,
      pitch: expect.closeTo(0.2 - 20 * DEG, 12),
    });
    expect(noticeBearing({ yaw: 0, pitch: -50 * DEG }).pitch).toBeCloseTo(-60 * DEG);
    expect(noticeBearing({ yaw: 0, pitch: -80 * DEG }).pitch).toBeCloseTo(-80 * DEG);
  });
});

describe("the panel's button", () => {
  it("hangs where a level gaze finds it, and out of the panel's way while that is open", () => {
    expect(openerPitch(false)).toBeCloseTo(-30 * DEG, 12);
    const button = 2 * DEG; // half of its height, 0.7 m away
    const lowest = -35 * DEG - HALF.pitch;
    expect(openerPitch(true) + button).toBeLessThan(lowest);
  });

  it("stays while the head turns a little, or looks down", () => {
    expect(followHead(0, { yaw: 0.5, pitch: 0 }, 1)).toBe(0);
    expect(followHead(0, { yaw: 2, pitch: -0.8 }, 1)).toBe(0);
  });

  it("follows a head that has turned away, the short way round", () => {
    let yaw = 3;
    for (let i = 0; i < 200; i++) yaw = followHead(yaw, { yaw: -2.5, pitch: 0 }, 0.05);
    expect(Math.abs(yaw)).toBeGreaterThan(2.5);
    expect(Math.abs(yaw + 2.5)).toBeLessThan(36 * DEG);
  });
});
