/**
 * Computes the medium through which paths go: extinction and albedo for every intensity, and the largest extinction in
 * every brick. Pure arrays.
 */
import type { Size3 } from "../bundle/ktx2";
import { ROWS } from "../bundle/transfer_2d";
import { ENTRIES } from "../voxels/transfer_luts";
import { envelopeOf, type TransferTable2d } from "../voxels/transfer_table_2d";

/** Largest opacity, 0..1; an opacity of 1 would mean an infinite extinction. */
const MAX_OPACITY = 0.999;

/** The colour and the transfer function of one channel: see voxels/march_tables.ts. */
export type MediumAppearance = Readonly<{
  color: readonly [number, number, number];
  table: Uint8Array;
  table2d?: TransferTable2d | null;
}>;

/**
 * Returns albedo (rgb) and extinction per um (a) of 256 intensities, 4 floats each, in a row for each channel.
 * If any channel has a two-dimensional transfer function, every channel has a row for each gradient.
 *
 * @param voxel_um length of the path to which an opacity in the tables refers
 * @param density factor to the extinction
 */
export function mediumTable(
  appearances: readonly MediumAppearance[],
  voxel_um: number,
  density: number,
): Float32Array<ArrayBuffer> {
  const count = rowsOf(appearances);
  const length = 4 * ENTRIES;
  const rows = new Float32Array(appearances.length * count * length);
  appearances.forEach(({ color, table, table2d }, c) => {
    for (let j = 0; j < count; j++) {
      const to = (c * count + j) * length;
      if (table2d == null && j > 0) {
        rows.copyWithin(to, c * count * length, (c * count + 1) * length);
        continue;
      }
      const row = table2d?.cells.subarray(j * length, (j + 1) * length) ?? table;
      fillRow(rows.subarray(to, to + length), row, color, voxel_um, density);
    }
  });
  return rows;
}

/** Returns the number of rows of each channel in `mediumTable`. */
export function rowsOf(appearances: readonly MediumAppearance[]): number {
  return appearances.some(({ table2d }) => table2d != null) ? ROWS : 1;
}

function fillRow(
  row: Float32Array,
  table: Uint8Array,
  color: MediumAppearance["color"],
  voxel_um: number,
  density: number,
): void {
  for (let i = 0; i < ENTRIES; i++) {
    for (let k = 0; k < 3; k++) row[4 * i + k] = (color[k] * table[4 * i + k]) / 255;
    const opacity = Math.min(table[4 * i + 3] / 255, MAX_OPACITY);
    row[4 * i + 3] = opacity === 0 ? 0 : (-Math.log(1 - opacity) / voxel_um) * density;
  }
}

/**
 * Returns the largest extinction in every brick for any gradient; no sample inside the brick exceeds it.
 *
 * @param table from `mediumTable`
 * @param bricks of each channel, smallest and largest intensity of every brick, interleaved
 */
export function majorants(
  table: Float32Array,
  bricks: readonly Uint8Array[],
): Float32Array<ArrayBuffer> {
  const count = bricks[0].length / 2;
  const found = new Float32Array(count);
  const length = table.length / bricks.length;
  bricks.forEach((channel, c) => {
    const rows = table.subarray(c * length, (c + 1) * length);
    const largest = largestBetween(envelopeOf(rows));
    for (let i = 0; i < count; i++) {
      found[i] += largest[channel[2 * i] * ENTRIES + channel[2 * i + 1]];
    }
  });
  return found;
}

/** Returns the largest value of each block of `factor`^3 bricks, and the number of blocks along each axis. */
export function coarserMajorants(
  fine: Float32Array<ArrayBuffer>,
  counts: Size3,
  factor: number,
): Readonly<{ majorants: Float32Array<ArrayBuffer>; counts: Size3 }> {
  if (factor === 1) return { majorants: fine, counts };
  const [nx, ny, nz] = counts;
  const [mx, my, mz] = counts.map((n) => Math.ceil(n / factor));
  const found = new Float32Array(mx * my * mz);
  for (let z = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) {
      const row = (Math.floor(z / factor) * my + Math.floor(y / factor)) * mx;
      for (let x = 0; x < nx; x++) {
        const to = row + Math.floor(x / factor);
        found[to] = Math.max(found[to], fine[(z * ny + y) * nx + x]);
      }
    }
  }
  return { majorants: found, counts: [mx, my, mz] };
}

/** Returns the largest extinction between intensities lo and hi, for every lo <= hi, at index lo * 256 + hi. */
function largestBetween(row: Float32Array): Float32Array {
  const found = new Float32Array(ENTRIES * ENTRIES);
  for (let lo = 0; lo < ENTRIES; lo++) {
    let largest = 0;
    for (let hi = lo; hi < ENTRIES; hi++) {
      largest = Math.max(largest, row[4 * hi + 3]);
      found[lo * ENTRIES + hi] = largest;
    }
  }
  return found;
}
