import { describe, expect, it } from "vitest";
import { WHOLE } from "../math/clip";
import {
  advanceFocus,
  discLimit,
  discReach,
  FAR_AWAY,
  type GazeInput,
  HYSTERESIS,
  isWaiting,
  MAX_DISC_TILES,
  REST_S,
} from "./focus_tiles";

/** Four rows of five tiles, 10 um each and 5 um deep, as seen from the front. */
const TILES = Array.from({ length: 20 }, (_, i) => {
  const [x, y] = [10 * (i % 5), -10 * Math.floor(i / 5)];
  return {
    id: `r${Math.floor(i / 5)}_c${i % 5}`,
    bounds_um: {
      min: [x, y - 10, 0] as [number, number, number],
      max: [x + 10, y, 5] as [number, number, number],
    },
  };
});

const input = (x: number, y: number, away: number, dt_s = 1): GazeInput => ({
  gaze: { origin: [x, y, 5 + away], direction: [0, 0, -1] },
  tiles: TILES,
  clip: WHOLE,
  switchDistance_um: 20,
  discRadius_rad: Math.atan(4 / 10), // 4 um at a distance of 10
  dt_s,
});

describe("the near tiles", () => {
  it("begin at the switch distance and end at 1.1 times that distance", () => {
    const near = (away: number, before = FAR_AWAY) =>
      advanceFocus(before, input(5, -5, away)).near.has("r0_c0");
    expect(near(20.1)).toBe(false);
    expect(near(19.9)).toBe(true);
    const there = advanceFocus(FAR_AWAY, input(5, -5, 19.9));
    expect(near(20 * HYSTERESIS - 0.1, there)).toBe(true);
    expect(near(20 * HYSTERESIS + 0.1, there)).toBe(false);
  });

  it("do not flicker when the distance varies slightly", () => {
    let state = FAR_AWAY;
    let changes = 0;
    for (let i = 0; i < 100; i++) {
      const had = state.near.has("r0_c0");
      state = advanceFocus(state, input(5, -5, 20 + (i % 2 === 0 ? 0.5 : -0.5)));
      if (had !== state.near.has("r0_c0")) changes++;
    }
    expect(changes).toBe(1);
  });
});

describe("the gazed tile", () => {
  it("is the first near tile along the centre of the view", () => {
    expect(advanceFocus(FAR_AWAY, input(25, -15, 10)).focusTile).toBe("r1_c2");
    expect(advanceFocus(FAR_AWAY, input(25, -15, 30)).focusTile).toBeNull();
    expect(advanceFocus(FAR_AWAY, input(60, -15, 10)).focusTile).toBeNull();
  });

  it("is not a tile that is cut away where the gaze meets it", () => {
    const plane = { normal: [0, 0, 1], offset_um: 0 } as const; // the plane cuts away all that lies in front of z = 0
    const cut = { ...input(25, -15, 10), clip: { box: null, plane } };
    expect(advanceFocus(FAR_AWAY, cut)).toMatchObject({ focusTile: null, disc: [] });
    const left = { ...cut, clip: { box: null, plane: { ...plane, offset_um: 1 } } };
    expect(advanceFocus(FAR_AWAY, left).focusTile).toBe("r1_c2");
  });

  it("changes only after the gaze has rested on another tile", () => {
    const first = advanceFocus(FAR_AWAY, input(5, -5, 10));
    const glance = advanceFocus(first, input(15, -5, 10, REST_S / 2));
    expect(glance.focusTile).toBe("r0_c0");
    expect(isWaiting(glance)).toBe(true);
    expect(advanceFocus(glance, input(5, -5, 10, REST_S)).focusTile).toBe("r0_c0");
    let state = glance;
    for (let i = 0; i < 3; i++) state = advanceFocus(state, input(15, -5, 10, REST_S / 2));
    expect(state.focusTile).toBe("r0_c1");
    expect(isWaiting(state)).toBe(false);
  });
});

describe("the disc", () => {
  it("requests the tiles that it covers, the gazed tile first", () => {
    expect(advanceFocus(FAR_AWAY, input(5, -5, 10)).disc).toEqual(["r0_c0"]);
    const edge = advanceFocus(FAR_AWAY, input(9, -5, 10)).disc;
    expect(edge).toEqual(["r0_c0", "r0_c1"]);
    const corner = advanceFocus(FAR_AWAY, input(9, -9, 10)).disc;
    expect(corner[0]).toBe("r0_c0");
    expect([...corner].sort()).toEqual(["r0_c0", "r0_c1", "r1_c0", "r1_c1"]);
  });

  it("has a radius of twelve degrees in the opening view of two rows of five tiles, for any gaze", () => {
    const tiles = TILES.slice(0, 10);
    const radius = (12 * Math.PI) / 180;
    for (const [x, y] of [
      [25, -10.1],
      [21, -9],
      [30, -4],
      [5, -15],
    ] as const) {
      const opening = { ...input(x, y, 75), tiles, switchDistance_um: 90, discRadius_rad: radius };
      expect(discLimit(advanceFocus(FAR_AWAY, opening), radius)).toBeNull();
    }
  });

  it("requests at most the largest number of tiles, and no distant tile", () => {
    const wide = { ...input(25, -10.1, 10), discRadius_rad: 1.2 };
    expect(advanceFocus(FAR_AWAY, wide).disc).toHaveLength(MAX_DISC_TILES);
    expect(advanceFocus(FAR_AWAY, input(9, -9, 25)).disc).toEqual([]);
  });

  it("reports the radius at which that limit ends it", () => {
    const wide = { ...input(25, -10.1, 10), discRadius_rad: 1.2 };
    const state = advanceFocus(FAR_AWAY, wide);
    const limit = discLimit(state, 1.2);
    expect(limit).toBe(discReach(state, 1.2, (id) => state.disc.includes(id)));
    expect(limit).toBeLessThan(1.2);
    expect(discLimit(advanceFocus(FAR_AWAY, input(9, -9, 10)), 0.2)).toBeNull(); // the disc covers four tiles
    expect(discLimit(FAR_AWAY, 1.2)).toBeNull();
  });

  it("ends before the first tile whose volume is not loaded", () => {
    const state = advanceFocus(FAR_AWAY, input(8, -5, 10));
    const radius = Math.atan(4 / 10);
    expect(discReach(state, radius, () => true)).toBe(radius);
    expect(discReach(state, radius, (id) => id === "r0_c1")).toBe(0);
    const reach = discReach(state, radius, (id) => id === "r0_c0");
    expect(reach).toBeLessThanOrEqual(Math.atan(2 / 10)); // the border of the tile is 2 um from the gaze
    expect(reach).toBeGreaterThan(0.8 * Math.atan(2 / 10));
    expect(discReach(FAR_AWAY, radius, () => true)).toBe(0);
  });
});
