import { Group, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { BoxedTile } from "../math/pick";
import { TileTarget } from "./tile_target";

const TILES: readonly BoxedTile[] = [
  { id: "near", bounds_um: { min: [0, 0, 10], max: [10, 10, 20] } },
  { id: "far", bounds_um: { min: [0, 0, 0], max: [10, 10, 10] } },
];

describe("the tile along a ray", () => {
  it("is chosen with a ray in um, and returns its distance in metres", () => {
    const specimen = new Group();
    specimen.matrixAutoUpdate = false;
    specimen.matrixWorld.makeScale(0.01, 0.01, 0.01).setPosition(-0.05, -0.05, -2);
    const chosen: unknown[] = [];
    const target = new TileTarget(specimen, (...given) => chosen.push(given));
    target.tiles = TILES;
    const ray = { origin: new Vector3(), direction: new Vector3(0, 0, -1) };
    const hit = target.intersect(ray);
    expect(hit?.key).toBe("tile:near");
    expect(hit?.distance_m).toBeCloseTo(1.8, 12);
    if (hit !== null) target.choose(hit, ray, true);
    const [[{ origin, direction }, ...named]] = chosen as [
      [{ origin: number[]; direction: number[] }, string, boolean],
    ];
    expect(named).toEqual(["near", true]);
    expect(origin.map((v) => Math.round(v * 1e6) / 1e6)).toEqual([5, 5, 200]);
    expect(direction[2]).toBeCloseTo(-100, 9);
  });
});

it("an object in a tile is hit instead of the tile, and names that tile", () => {
  const specimen = new Group();
  const chosen: unknown[][] = [];
  let hasObject = true;
  const target = new TileTarget(
    specimen,
    (...given) => chosen.push(given),
    ({ direction }) => (hasObject ? { id: "cells/7", distance: 1.5 * -direction[2] } : null),
  );
  target.tiles = [{ id: "r0_c0", bounds_um: { min: [-1, -1, -2], max: [1, 1, -1] } }];
  const ray = { origin: new Vector3(), direction: new Vector3(0, 0, -1) };
  expect(target.intersect(ray)).toMatchObject({ key: "tile:r0_c0/cells/7", distance_m: 1.5 });
  target.choose({ key: "tile:r0_c0/cells/7", distance_m: 1.5 }, ray, true);
  expect(chosen.map(([, tile, isByGaze]) => [tile, isByGaze])).toEqual([["r0_c0", true]]);
  hasObject = false;
  expect(target.intersect(ray)?.key).toBe("tile:r0_c0");
});
