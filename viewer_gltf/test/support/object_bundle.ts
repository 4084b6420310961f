/** The bundle of a label map that tests/support/object_bundle.py writes, and the places of its cells. */
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { beforeAll } from "vitest";
import { askPython } from "./python";

type Vec3 = readonly [number, number, number];

// the same values as in tests/support/object_bundle.py
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

/** Returns the middle of a ball, um. */
export function centerOf(row: number): Vec3 {
  const [tile, rest] = [Math.floor(row / PER_TILE), row % PER_TILE];
  const [x, y, z] = [
    rest % GRID[0],
    Math.floor(rest / GRID[0]) % GRID[1],
    Math.floor(rest / GRID[0] / GRID[1]),
  ];
  return [60 * tile + 6 + 12 * x, -6 - 12 * y, 6 + 12 * z];
}

/** Returns the row of a place in the grid. */
export const rowAt = (tile: number, x: number, y: number, z: number) =>
  PER_TILE * tile + x + GRID[0] * (y + GRID[1] * z);

type Written = Readonly<{ folder: string; write: () => Promise<unknown> }>;

/** Bundles by their flags. All test files of a process share them, and no test changes them. */
const bundles = new Map<string, Written>();

/**
 * Returns the folder of the bundle, which is written before the tests of a `describe`. Must be
 * called inside it, before the stand is prepared.
 */
export function prepareObjects(...flags: readonly string[]): string {
  const key = flags.join(" ");
  const { folder, write } = bundles.get(key) ?? writtenOnce(flags);
  bundles.set(key, { folder, write });
  beforeAll(async () => {
    await write();
  });
  return folder;
}

function writtenOnce(flags: readonly string[]): Written {
  const folder = mkdtempSync(join(tmpdir(), "stereocell-objects-"));
  process.once("exit", () => rmSync(folder, { recursive: true, force: true }));
  let writing: Promise<unknown> | undefined;
  const write = () => {
    writing ??= askPython("object_bundle", [folder, ...flags], "");
    return writing;
  };
  return { folder, write };
}
