import { expect, it } from "vitest";
import { CELL, cellCounts } from "../bundle/cell_ranges";
import { SKIP_BRICK } from "../bundle/generated/constants";
import { brickCounts } from "../voxels/skip_bricks";
import type { Packed } from "../voxels/tile_texture";
import { volumeTexture } from "../voxels/volume_texture";
import { SkipTables } from "./skip_tables";

const SIZE = [20, 20, 20] as const;
const HALF = [10, 10, 10] as const;

function levelOf(level: number): Packed {
  const size = level === 0 ? SIZE : HALF;
  const texels = new Uint8Array(size[0] ** 3);
  const texture = volumeTexture(texels, [...size], 1);
  return { channels: ["A"], level, texture, index: null, bricks: [], cells: [] };
}

const zeros = ([x, y, z]: readonly [number, number, number]) => new Uint8Array(x * y * z);

function made() {
  const tables = new SkipTables([...SIZE]);
  const { uSkipScale, uSkipShift, uBrickSlack } = tables.uniforms;
  const inUse = () => (uSkipShift.value === 0 ? "bricks" : "cells");
  return { tables, inUse, uSkipScale, uBrickSlack };
}

it("the table of cells is used once its level is shown alone", () => {
  const { tables, inUse, uSkipScale, uBrickSlack } = made();
  const [coarse, fine] = [levelOf(1), levelOf(0)];
  tables.setBricks(zeros(brickCounts([...SIZE])));
  tables.sync(coarse, null);
  expect([inUse(), uBrickSlack.value]).toEqual(["bricks", 1]);
  tables.setCells(coarse, zeros(cellCounts([...HALF])), [...HALF]);
  tables.sync(coarse, null);
  expect([inUse(), uBrickSlack.value]).toEqual(["cells", 0]);
  expect(uSkipScale.value.x).toBe(HALF[0] / CELL);

  tables.setCells(fine, zeros(cellCounts([...SIZE])), [...SIZE]);
  tables.sync(fine, coarse); // fades in, so that both levels are visible
  expect([inUse(), uBrickSlack.value]).toEqual(["bricks", 1]);
  expect(uSkipScale.value.x).toBe(SIZE[0] / SKIP_BRICK);
  tables.sync(fine, null);
  expect(inUse()).toBe("cells");
  expect(uSkipScale.value.x).toBe(SIZE[0] / CELL);
});

it("both tables are out of date when other intensities become visible", () => {
  const { tables, inUse } = made();
  const shown = levelOf(0);
  tables.setBricks(zeros(brickCounts([...SIZE])).fill(3));
  tables.setCells(shown, zeros(cellCounts([...SIZE])), [...SIZE]);
  tables.setBricks(null);
  tables.sync(shown, null);
  expect(inUse()).toBe("bricks");
  const { data } = tables.uniforms.uOccupancy.value.image;
  expect(new Set(data as Uint8Array)).toEqual(new Set([0]));
});
