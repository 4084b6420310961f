/**
 * The share of light that passes each cell of a coarse grid around all volumes, under the current
 * transfer functions. Occlusion and shadows are computed from it. Cells are cubes of the world, at
 * most MAX_CELLS, x fastest. Each is sampled at eight places.
 */

import type { Size3 } from "../../bundle/ktx2";
import type { Box } from "../../math/box";
import type { Vec3 } from "../../math/vec3";

/** Largest number of cells: with one byte each for openness and light, 512 KiB of GPU memory. */
export const MAX_CELLS = 64 ** 3;
/** Cells around the volumes' box, so that a lookup at its face finds the space in front of it. */
const MARGIN = 1;
/** Offsets of the samples from a cell's middle, in edges of the cell. */
const ASIDE = [-0.25, 0.25] as const;
/** Largest share of light that one voxel takes in the ray march. */
const MAX_OPACITY = 0.999;

export type Grid = Readonly<{
  /** The low corner, um, world. */
  low: Vec3;
  /** Edge of a cell, um. */
  edge: number;
  /** Cells along x, y, z. */
  size: Size3;
}>;

/** The volumes of one tile, at a coarse mip level. */
export type TileMatter = Readonly<{
  /**
   * Intensities of each channel, x fastest, and the opacity (0 to 255) of a voxel at each of 256
   * intensities.
   */
  channels: readonly Readonly<{ texels: Uint8Array; opacities: Uint8Array }>[];
  /** Texels along x, y, z. */
  size: Size3;
  /** Size of the finest mip level, in texels of this level; the last texel may extend beyond it. */
  whole: Vec3;
  /** The tile's box in the texture, 0 to 1. */
  low: Vec3;
  high: Vec3;
  /** Matrix from the world, um, to texture coordinates, column by column. */
  toTexture: readonly number[];
  /** Length of path for which the opacities hold, um. */
  voxel_um: number;
}>;

/** The clip, um, world. */
export type Cut = Readonly<{
  box: Box;
  /** Unit normal and offset. */
  plane: Plane;
  /** Points beyond all of these planes are removed. */
  corner: readonly Plane[];
}>;
type Plane = readonly [number, number, number, number];

/** The finest grid around a box that has at most `most` cells. */
export function gridRound({ min, max }: Box, most = MAX_CELLS): Grid {
  const sides = min.map((v, i) => Math.max(max[i] - v, 1e-6));
  const cellsAt = (edge: number) => sides.map((side) => Math.ceil(side / edge - 1e-6) + 2 * MARGIN);
  const count = (edge: number) => cellsAt(edge).reduce((all, n) => all * n, 1);
  let edge = Math.cbrt((sides[0] * sides[1] * sides[2]) / most);
  edge = Math.max(edge, Math.max(...sides) / most);
  while (count(edge) > most) edge *= 1.002;
  const [x, y, z] = cellsAt(edge);
  const [cx, cy, cz] = min.map((v, i) => (v + max[i]) / 2);
  const low: Vec3 = [cx - (x * edge) / 2, cy - (y * edge) / 2, cz - (z * edge) / 2];
  return { low, edge, size: [x, y, z] };
}

/** The share of light, 0 to 1, that passes straight through each cell. */
export function throughCells(
  grid: Grid,
  tiles: readonly TileMatter[],
  cut: Cut | null,
): Float32Array {
  const [nx, ny, nz] = grid.size;
  const through = new Float32Array(nx * ny * nz).fill(1);
  for (const tile of tiles) addTile(through, grid, tile);
  if (cut !== null) clear(through, grid, cut);
  return through;
}

function addTile(through: Float32Array, grid: Grid, tile: TileMatter): void {
  const { edge, low } = grid;
  const [nx, ny] = grid.size;
  const m = tile.toTexture;
  const tables = tile.channels.map(({ opacities }) =>
    Float32Array.from(
      opacities,
      (a) => (1 - Math.min(a / 255, MAX_OPACITY)) ** (edge / tile.voxel_um),
    ),
  );
  const isDimming = dimmingTexels(tile, tables);
  const clearAt = clearnessOf(tile, tables);
  const [sx, sy, sz] = tile.size;
  const [wx, wy, wz] = tile.whole;
  const [lowX, lowY, lowZ] = tile.low;
  const [highX, highY, highZ] = tile.high;
  const share = 1 / ASIDE.length ** 3;
  const places = [0, 1, 2].map((axis) =>
    Float64Array.from(
      { length: ASIDE.length * grid.size[axis] },
      (_, i) => low[axis] + (Math.floor(i / ASIDE.length) + 0.5 + ASIDE[i % ASIDE.length]) * edge,
    ),
  );
  const [xs, ys, zs] = places;
  // a separate function, because a function that is called often is compiled sooner than a long
  // loop
  const addRow = (row: number, u0: number, v0: number, w0: number) => {
    if (m[1] === 0 && (v0 < lowY || v0 >= highY)) return; // the whole row is outside the tile
    if (m[2] === 0 && (w0 < lowZ || w0 >= highZ)) return;
    for (let i = 0; i < xs.length; i++) {
      const u = m[0] * xs[i] + u0;
      if (u < lowX || u >= highX) continue;
      const v = m[1] * xs[i] + v0;
      if (v < lowY || v >= highY) continue;
      const w = m[2] * xs[i] + w0;
      if (w < lowZ || w >= highZ) continue;
      // Interpolation between texels, whose middles lie at a half; beyond the last texel its value
      // is used.
      const tx = Math.min(sx - 1, Math.max(0, u * wx - 0.5));
      const ty = Math.min(sy - 1, Math.max(0, v * wy - 0.5));
      const tz = Math.min(sz - 1, Math.max(0, w * wz - 0.5));
      const at = (Math.trunc(tz) * sy + Math.trunc(ty)) * sx + Math.trunc(tx);
      if (isDimming[at] === 1) {
        through[row + Math.floor(i / ASIDE.length)] -= share * (1 - clearAt(tx, ty, tz));
      }
    }
  };
  zs.forEach((pz, k) => {
    ys.forEach((py, j) => {
      const u0 = m[4] * py + m[8] * pz + m[12];
      const v0 = m[5] * py + m[9] * pz + m[13];
      const w0 = m[6] * py + m[10] * pz + m[14];
      const [y, z] = [Math.floor(j / ASIDE.length), Math.floor(k / ASIDE.length)];
      addRow((z * ny + y) * nx, u0, v0, w0);
    });
  });
}

/** The share of light that all channels transmit at a place between texels. */
function clearnessOf(
  { channels, size: [sx, sy, sz] }: TileMatter,
  tables: readonly Float32Array[],
): (x: number, y: number, z: number) => number {
  return (x, y, z) => {
    const i = Math.trunc(x);
    const j = Math.trunc(y);
    const k = Math.trunc(z);
    const fx = x - i;
    const fy = y - j;
    const fz = z - k;
    const at = (k * sy + j) * sx + i;
    const right = i + 1 < sx ? 1 : 0;
    const down = j + 1 < sy ? sx : 0;
    const there = at + (k + 1 < sz ? sx * sy : 0);
    let clear = 1;
    for (let c = 0; c < tables.length; c++) {
      const t = channels[c].texels;
      const a = t[at] + fx * (t[at + right] - t[at]);
      const b = t[at + down] + fx * (t[at + down + right] - t[at + down]);
      const d = t[there] + fx * (t[there + right] - t[there]);
      const e = t[there + down] + fx * (t[there + down + right] - t[there + down]);
      const near = a + fy * (b - a);
      const value = near + fz * (d + fy * (e - d) - near);
      clear *= tables[c][Math.round(value)];
    }
    return clear;
  };
}

/**
 * Marks a texel with 1 if any channel may take light between it and its next neighbours along the
 * axes. Most texels stay 0.
 */
function dimmingTexels(
  { channels, size: [sx, sy, sz] }: TileMatter,
  tables: readonly Float32Array[],
): Uint8Array {
  const found = new Uint8Array(sx * sy * sz);
  channels.forEach(({ texels }, c) => {
    const next = nextDimming(tables[c]);
    if (next[0] > 255) return;
    for (let k = 0, at = 0; k < sz; k++) {
      const back = k + 1 < sz ? sx * sy : 0;
      for (let j = 0; j < sy; j++, at += sx) {
        markRow(found, texels, next, at, sx, j + 1 < sy ? sx : 0, back);
      }
    }
  });
  return found;
}

/**
 * Marks one row, from the smallest and largest value of each texel and its next neighbours. `down`
 * and `back` are the steps of the index to the next row and to the next plane; 0 at the end.
 */
function markRow(
  found: Uint8Array,
  texels: Uint8Array,
  next: Uint16Array,
  from: number,
  count: number,
  down: number,
  back: number,
): void {
  let least = 0;
  let most = 0;
  for (let x = count - 1; x >= 0; x--) {
    const at = from + x;
    const a = texels[at];
    const b = texels[at + down];
    const c = texels[at + back];
    const d = texels[at + down + back];
    const low = Math.min(a, b, c, d);
    const high = Math.max(a, b, c, d);
    const isLast = x === count - 1;
    if (next[isLast ? low : Math.min(low, least)] <= (isLast ? high : Math.max(high, most))) {
      found[at] = 1;
    }
    least = low;
    most = high;
  }
}

/**
 * For each intensity, the lowest intensity from it upwards that takes light; 256 if there is none.
 */
function nextDimming(table: Float32Array): Uint16Array {
  const next = new Uint16Array(256);
  for (let v = 255, last = 256; v >= 0; v--) {
    if (table[v] < 1) last = v;
    next[v] = last;
  }
  return next;
}

function clear(through: Float32Array, { low, edge, size: [nx, ny, nz] }: Grid, cut: Cut): void {
  const { min, max } = cut.box;
  for (let z = 0, at = 0; z < nz; z++) {
    const pz = low[2] + (z + 0.5) * edge;
    for (let y = 0; y < ny; y++) {
      const py = low[1] + (y + 0.5) * edge;
      const isOut = pz < min[2] || pz > max[2] || py < min[1] || py > max[1];
      for (let x = 0; x < nx; x++, at++) {
        const px = low[0] + (x + 0.5) * edge;
        const isBeyond = ([a, b, c, d]: Plane) => a * px + b * py + c * pz > d;
        const isGone = isOut || px < min[0] || px > max[0] || isBeyond(cut.plane);
        if (isGone || cut.corner.every(isBeyond)) through[at] = 1;
      }
    }
  }
}
