import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { BAR_HEIGHT } from "../../panel/canvas/bar";
import { PX_PER_M } from "../../panel/canvas/page";
import {
  barPitch,
  bearingOf,
  followHead,
  noticeBearing,
  PANEL_DISTANCE_M,
  panelBearing,
  pointAt,
} from "./placement";

const DEG = Math.PI / 180;
const EYE = new Vector3(0.3, 1.6, -0.2);
/** From the panel's middle to its edge. */
const HALF_PITCH = 20 * DEG;

describe("the panel's place", () => {
  it("is straight below the gaze, also of one who has turned round", () => {
    for (const yaw of [0, 0.7, 3, -2.5]) {
      for (const pitch of [0.2, 0, -0.5]) {
        expect(panelBearing({ yaw, pitch }, 0)).toEqual({ yaw, pitch: expect.closeTo(-24 * DEG) });
      }
    }
  });

  it("is over a specimen on a table, above its upper edge and about level", () => {
    const { pitch } = panelBearing({ yaw: 0, pitch: -0.7 }, 0, true);
    const upper = Math.atan2(0.24 - 0.5, 0.9); // of 48 cm, their middle half a metre under the eyes
    expect(pitch - HALF_PITCH).toBeGreaterThan(upper);
    expect(pitch).toBeLessThan(10 * DEG);
  });

  it("is where the button was for one who looks straight down, with no heading", () => {
    expect(panelBearing({ yaw: 2, pitch: -85 * DEG }, 0.3).yaw).toBe(0.3);
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

describe("the bar", () => {
  it("hangs where a level gaze finds it, and out of the panel's way while that is open", () => {
    expect(barPitch(false)).toBeCloseTo(-30 * DEG, 12);
    const bar = Math.atan(BAR_HEIGHT / PX_PER_M / 2 / PANEL_DISTANCE_M);
    const lowest = -24 * DEG - HALF_PITCH;
    expect(barPitch(true) + bar).toBeLessThan(lowest);
  });

  it("stays while the head turns a little, or looks down", () => {
    expect(followHead(0, { yaw: 0.25, pitch: 0 }, 1)).toBe(0);
    expect(followHead(0, { yaw: 2, pitch: -0.8 }, 1)).toBe(0);
  });

  it("follows a head that has turned away, the short way round", () => {
    let yaw = 3;
    for (let i = 0; i < 200; i++) yaw = followHead(yaw, { yaw: -2.5, pitch: 0 }, 0.05);
    expect(Math.abs(yaw)).toBeGreaterThan(2.5);
    expect(Math.abs(yaw + 2.5)).toBeLessThan(16 * DEG);
  });
});
