import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { BAR_HEIGHT, BAR_WIDTH } from "../../panel/canvas/bar";
import { HEIGHT, PX_PER_M, WIDTH } from "../../panel/canvas/page";
import { LONGEST_EDGE_M, ROOM_DISTANCE_M, ROOM_SIZE, UNDER_EYES_M } from "../../render/placement";
import {
  barPitch,
  bearingOf,
  followHead,
  noticeBearing,
  panelBearing,
  panelDistance_m,
  pointAt,
  type Setting,
} from "./placement";

const DEG = Math.PI / 180;
const EYE = new Vector3(0.3, 1.6, -0.2);
const LEVEL = { yaw: 0, pitch: 0 };
/** Half the angle of a length on a texture, px, in radians. */
const half = (px: number, setting: Setting) =>
  Math.atan(px / PX_PER_M / 2 / panelDistance_m(setting));
/** Pitch of the lower and the upper edge, radians. */
const edges = (pitch: number, height_px: number, setting: Setting) =>
  [pitch - half(height_px, setting), pitch + half(height_px, setting)] as const;
const panelEdges = (setting: Setting) =>
  edges(panelBearing(LEVEL, 0, setting).pitch, HEIGHT, setting);
const barEdges = (setting: Setting, isOpen: boolean) =>
  edges(barPitch(setting, isOpen), BAR_HEIGHT, setting);

describe("the panel's position", () => {
  it("is straight below the gaze, even after the user has turned around", () => {
    for (const yaw of [0, 0.7, 3, -2.5]) {
      for (const pitch of [0.2, 0, -0.5]) {
        expect(panelBearing({ yaw, pitch }, 0)).toEqual({
          yaw,
          pitch: expect.closeTo(-27.5 * DEG),
        });
      }
    }
  });

  it("has the bar's heading if the user looks straight down and has no heading", () => {
    expect(panelBearing({ yaw: 2, pitch: -85 * DEG }, 0.3).yaw).toBe(0.3);
  });

  it("converts back to the same bearing", () => {
    const at = pointAt({ yaw: 0.7, pitch: -0.4 }, EYE, 1.2);
    expect(at.distanceTo(EYE)).toBeCloseTo(1.2, 12);
    const { yaw, pitch } = bearingOf(at.sub(EYE));
    expect([yaw, pitch]).toEqual([expect.closeTo(0.7, 12), expect.closeTo(-0.4, 12)]);
  });
});

describe("a notice", () => {
  it("is below the gaze, unless the gaze is at the floor", () => {
    expect(noticeBearing({ yaw: 1, pitch: 0.2 })).toEqual({
      yaw: 1,
      pitch: expect.closeTo(0.2 - 20 * DEG, 12),
    });
    expect(noticeBearing({ yaw: 0, pitch: -50 * DEG }).pitch).toBeCloseTo(-60 * DEG);
    expect(noticeBearing({ yaw: 0, pitch: -80 * DEG }).pitch).toBeCloseTo(-80 * DEG);
  });
});

describe("the bar", () => {
  it("hangs 30 degrees below a level gaze", () => {
    expect(barPitch("before-eyes", false)).toBeCloseTo(-30 * DEG, 12);
  });

  it.each(["before-eyes", "over-table", "in-hand"] as const)(
    "is below the open panel and close to it: %s",
    (setting) => {
      const [, upper] = barEdges(setting, true);
      const [lower] = panelEdges(setting);
      expect(upper).toBeLessThan(lower);
      expect(upper).toBeGreaterThan(lower - 2 * DEG);
    },
  );

  it("stays while the head turns a little or looks down", () => {
    expect(followHead(0, { yaw: 0.25, pitch: 0 }, 1)).toBe(0);
    expect(followHead(0, { yaw: 2, pitch: -0.8 }, 1)).toBe(0);
  });

  it("follows a head that has turned away, by the shorter way", () => {
    let yaw = 3;
    for (let i = 0; i < 200; i++) yaw = followHead(yaw, { yaw: -2.5, pitch: 0 }, 0.05);
    expect(Math.abs(yaw)).toBeGreaterThan(2.5);
    expect(Math.abs(yaw + 2.5)).toBeLessThan(16 * DEG);
  });

  it("follows a user who walks around a table and looks down at the specimen", () => {
    for (const setting of ["over-table", "in-hand"] as const) {
      const yaw = followHead(0, { yaw: 1.5, pitch: -36 * DEG }, 1, setting);
      expect(yaw, setting).toBeGreaterThan(1);
      const looked = { yaw: 1.5, pitch: barPitch(setting, false) };
      expect(followHead(0, looked, 1, setting), setting).toBe(0);
    }
  });
});

/**
 * Pitches at which the eyes see the largest cube on the table, radians: its near lower edge, and
 * the middle of its upper face.
 */
function cubeOnTable(): readonly [lower: number, upper: number] {
  const halfEdge_m = (LONGEST_EDGE_M * ROOM_SIZE) / 2;
  const at = (up_m: number, away_m: number) =>
    Math.atan2(up_m - UNDER_EYES_M, ROOM_DISTANCE_M + away_m);
  return [at(-halfEdge_m, -halfEdge_m), at(halfEdge_m, 0)];
}

describe("a specimen on a table", () => {
  const [lower, upper] = cubeOnTable();

  it("is not hidden by the panel or the bar in a headset, and both are within reach", () => {
    for (const isOpen of [false, true]) {
      expect(barEdges("over-table", isOpen)[0]).toBeGreaterThan(upper);
    }
    expect(panelEdges("over-table")[0]).toBeGreaterThan(upper);
    expect(panelEdges("over-table")[1]).toBeLessThan(37 * DEG);
  });

  it("is not hidden by the bar on a phone's screen, which shows bar and panel", () => {
    for (const isOpen of [false, true]) {
      expect(barEdges("in-hand", isOpen)[1]).toBeLessThan(lower);
    }
    const middle = Math.atan2(-UNDER_EYES_M, ROOM_DISTANCE_M);
    // the camera of an upright phone shows about 65 x 35 degrees
    expect(barEdges("in-hand", true)[0]).toBeGreaterThan(middle - 32.5 * DEG);
    expect(panelEdges("in-hand")[1]).toBeLessThan(middle + 32.5 * DEG);
    for (const width of [WIDTH, BAR_WIDTH]) {
      expect(half(width, "in-hand")).toBeLessThan(17.5 * DEG);
    }
  });
});
