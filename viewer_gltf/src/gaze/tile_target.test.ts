import { Group, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { meetTile, TileTarget } from "./tile_target";

const TILES = [
  { id: "near", bounds_um: { min: [0, 0, 10], max: [10, 10, 20] } },
  { id: "far", bounds_um: { min: [0, 0, 0], max: [10, 10, 10] } },
] as const;
const WHOLE = { isolated: null, clip: { box: null, plane: null } };
const RAY = { origin: [5, 5, 50], direction: [0, 0, -2] } as const;

describe("the tile along a ray", () => {
  const tiles = TILES.map(({ id, bounds_um: { min, max } }) => ({
    id,
    bounds_um: {
      min: [...min] as [number, number, number],
      max: [...max] as [number, number, number],
    },
  }));

  it("is the first one, as far away as its face", () => {
    expect(meetTile(RAY, tiles, WHOLE)).toEqual({ id: "near", distance: 15 });
  });

  it("is the one behind, where the first is cut away or gone", () => {
    const plane = { normal: [0, 0, 1] as const, offset_um: 6 };
    const cut = { isolated: null, clip: { box: null, plane } };
    expect(meetTile(RAY, tiles, cut)).toEqual({ id: "far", distance: 22 });
    expect(meetTile(RAY, tiles, { ...WHOLE, isolated: "far" })?.id).toBe("far");
  });

  it("is chosen with a ray in um, and its distance is in metres", () => {
    const specimen = new Group();
    specimen.matrixAutoUpdate = false;
    specimen.matrixWorld.makeScale(0.01, 0.01, 0.01).setPosition(-0.05, -0.05, -2);
    const chosen: unknown[] = [];
    const target = new TileTarget(tiles, specimen, (ray, tile) => chosen.push([ray, tile]));
    const ray = { origin: new Vector3(), direction: new Vector3(0, 0, -1) };
    const hit = target.meet(ray);
    expect(hit?.key).toBe("tile:near");
    expect(hit?.distance_m).toBeCloseTo(1.8, 12);
    if (hit !== null) target.choose(hit, ray);
    const [[{ origin, direction }, tile]] = chosen as [
      [{ origin: number[]; direction: number[] }, string],
    ];
    expect(tile).toBe("near");
    expect(origin.map((v) => Math.round(v * 1e6) / 1e6)).toEqual([5, 5, 200]);
    expect(direction[2]).toBeCloseTo(-100, 9);
  });
});
