import { describe, expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import { type Clip, isKept, WHOLE } from "./clip";
import { type BoxedTile, pickTile, shownTiles } from "./pick";
import type { Ray, Vec3 } from "./vec3";

const TILES: readonly BoxedTile[] = [
  { id: "left", bounds_um: { min: [0, -10, 0], max: [10, 0, 5] } },
  { id: "right", bounds_um: { min: [10, -10, 0], max: [20, 0, 5] } },
];
const AHEAD_LEFT: Ray = { origin: [5, -5, 105], direction: [0, 0, -2] };
const ACROSS: Ray = { origin: [-100, -5, 2], direction: [1, 0, 0] };

const pick = (origin: Vec3, direction: Vec3, clip = WHOLE) =>
  pickTile({ origin, direction }, TILES, clip)?.id ?? null;

describe("the tile under the gaze", () => {
  it("is the first tile along the ray", () => {
    expect(pick([15, -5, 100], [0, 0, -1])).toBe("right");
    expect(pick([-100, -5, 2], [1, 0, 0])).toBe("left");
    expect(pick([100, -5, 2], [-1, 0, 0])).toBe("right");
  });

  it("is null if the ray misses or points away", () => {
    expect(pick([15, 5, 100], [0, 0, -1])).toBeNull();
    expect(pick([15, -5, 100], [0, 0, 1])).toBeNull();
  });

  it("is at the distance of its near face, or at 0 inside, in multiples of the direction", () => {
    expect(pickTile(AHEAD_LEFT, TILES, WHOLE)?.distance).toBe(50);
    expect(pickTile({ ...AHEAD_LEFT, origin: [5, -5, 2] }, TILES, WHOLE)?.distance).toBe(0);
  });

  it("can be flat", () => {
    const flat: BoxedTile = { id: "flat", bounds_um: { min: [0, -10, 3], max: [10, 0, 3] } };
    expect(pickTile(AHEAD_LEFT, [flat], WHOLE)).toEqual({ id: "flat", distance: 51 });
    const before = { box: null, plane: { normal: [0, 0, 1], offset_um: 2 } } as const;
    expect(pickTile(AHEAD_LEFT, [flat], before)).toBeNull();
  });

  it("is one of the shown tiles", () => {
    expect(shownTiles(TILES, null)).toBe(TILES);
    expect(pickTile(ACROSS, shownTiles(TILES, "right"), WHOLE)?.id).toBe("right");
  });
});

describe("the tile under the gaze in a clipped specimen", () => {
  const planeAt = (x: number): Clip => ({
    box: null,
    plane: { normal: [-1, 0, 0], offset_um: -x }, // keeps the right side
  });

  it("begins at the clip plane", () => {
    expect(pickTile(ACROSS, TILES, planeAt(4))).toEqual({ id: "left", distance: 104 });
  });

  it("is the next tile if the first is clipped away, even exactly at its face", () => {
    expect(pickTile(ACROSS, TILES, planeAt(12))).toEqual({ id: "right", distance: 112 });
    expect(pickTile(ACROSS, TILES, planeAt(10))).toEqual({ id: "right", distance: 110 });
    expect(pickTile(ACROSS, TILES.slice(0, 1), planeAt(10))).toBeNull();
  });

  it("is null if nothing is left along the ray", () => {
    expect(pickTile(ACROSS, TILES, planeAt(20))).toBeNull();
    const aside: Clip = { box: { min: [0, -3, 0], max: [20, 0, 5] }, plane: null };
    expect(pickTile(ACROSS, TILES, aside)).toBeNull();
  });

  it("is hit at its first kept point, for any ray, box and plane", () => {
    const random = seeded(11);
    const part = (low: number, high: number) => low + (high - low) * random();
    const anywhere = (): Vec3 => [part(-5, 25), part(-15, 5), part(-5, 10)];
    const isWithin = (p: Vec3, { bounds_um }: BoxedTile) =>
      isKept(p, { box: bounds_um, plane: null });
    let hits = 0;
    for (let run = 0; run < 400; run++) {
      const [a, b, origin, to] = [anywhere(), anywhere(), anywhere(), anywhere()];
      const direction: Vec3 = [to[0] - origin[0], to[1] - origin[1], to[2] - origin[2]];
      const min: Vec3 = [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.min(a[2], b[2])];
      const max: Vec3 = [Math.max(a[0], b[0]), Math.max(a[1], b[1]), Math.max(a[2], b[2])];
      const offset_um = part(-10, 10);
      const clip: Clip = {
        box: random() < 0.5 ? null : { min, max },
        plane: random() < 0.5 ? null : { normal: [0.6, 0, 0.8], offset_um },
      };
      const found = pickTile({ origin, direction }, TILES, clip);
      const step = 1e-3;
      let first: number | null = null;
      for (let t = step / 2; t < 3 && first === null; t += step) {
        const p: Vec3 = [
          origin[0] + t * direction[0],
          origin[1] + t * direction[1],
          origin[2] + t * direction[2],
        ];
        if (isKept(p, clip) && TILES.some((tile) => isWithin(p, tile))) first = t;
      }
      if (first === null) continue; // less than one step of the tile is left, or nothing
      hits++;
      expect(Math.abs((found?.distance ?? Number.NaN) - first)).toBeLessThan(2 * step);
    }
    expect(hits).toBeGreaterThan(50);
  });
});
