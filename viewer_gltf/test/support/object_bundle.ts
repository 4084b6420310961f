/** The bundle of a label map that tests/support/object_bundle.py writes, and where its cells are. */
import { mkdtempSync } from "node:fs";
import { rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll } from "vitest";
import { askPython } from "./python";

type Vec3 = readonly [number, number, number];

// as in tests/support/object_bundle.py
export const CHANNEL = "cells";
export const COLORS: readonly Vec3[] = [
  [0.9, 0.2, 0.1],
  [0.1, 0.4, 0.9],
  [0.2, 0.7, 0.2],
];
const GRID = [5, 3, 2] as const;
export const PER_TILE = GRID[0] * GRID[1] * GRID[2];
export const COUNT = 2 * PER_TILE + 1;
export const BEAM = COUNT - 1;
export const BEAM_MIDDLE: Vec3 = [60, -42.5, 12];
export const RADIUS_UM = 4;

export const labelOf = (row: number) => row + 101;

/** The middle of a ball, um. */
export function centerOf(row: number): Vec3 {
  const [tile, rest] = [Math.floor(row / PER_TILE), row % PER_TILE];
  const [x, y, z] = [
    rest % GRID[0],
    Math.floor(rest / GRID[0]) % GRID[1],
    Math.floor(rest / GRID[0] / GRID[1]),
  ];
  return [60 * tile + 6 + 12 * x, -6 - 12 * y, 6 + 12 * z];
}

/** The row of a place in the grid. */
export const rowAt = (tile: number, x: number, y: number, z: number) =>
  PER_TILE * tile + x + GRID[0] * (y + GRID[1] * z);

/** Its folder, written before the tests of a `describe`; to be used inside it, before the stand. */
export function prepareObjects(...flags: readonly string[]): string {
  const folder = mkdtempSync(join(tmpdir(), "stereocell-objects-"));
  beforeAll(async () => {
    await askPython("object_bundle", [folder, ...flags], "");
  });
  afterAll(() => rm(folder, { recursive: true, force: true }));
  return folder;
}
