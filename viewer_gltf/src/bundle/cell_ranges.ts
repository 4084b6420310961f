/**
 * Smallest and largest value of the cells of a volume, by which a ray skips what it need not sample.
 * A cell is the cube between CELL + 1 texel centres along each axis, so a trilinear sample inside it
 * reads no other texels. Plain arrays.
 *
 * The bricks of a bundle are twice as long. In volumes of small bodies, twice as much of the volume
 * lies in bricks that show something as in such cells.
 */
import type { Size3 } from "./ktx2";

/** Edge of a cell, in texels of the mip level that is drawn. */
export const CELL = 4;

/** Number of cells along each axis of a volume with this number of texels. */
export function cellCounts(size: Size3): Size3 {
  const [x, y, z] = size.map((n) => Math.max(1, Math.ceil((n - 1) / CELL)));
  return [x, y, z];
}

/**
 * Returns the smallest and largest value of each cell, interleaved.
 *
 * @param texels one byte each, x fastest
 */
export function cellRanges(texels: Uint8Array, size: Size3): Uint8Array<ArrayBuffer> {
  const [nx, ny, nz] = size;
  const [cx, cy, cz] = cellCounts(size);
  const ranges = new Uint8Array(2 * cx * cy * cz);
  for (let i = 0; i < ranges.length; i += 2) ranges[i] = 255;
  const row = new Uint8Array(2 * cx);
  for (let z = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) {
      rangesOfRow(texels, (z * ny + y) * nx, nx, row);
      for (const k of cellsOf(z, cz)) {
        for (const j of cellsOf(y, cy)) widen(ranges, 2 * (k * cy + j) * cx, row);
      }
    }
  }
  return ranges;
}

/** The cells along an axis to which a texel belongs: two, if it lies between them. */
function cellsOf(texel: number, count: number): readonly number[] {
  const cell = Math.min(count - 1, Math.floor(texel / CELL));
  return texel % CELL === 0 && cell > 0 && cell * CELL === texel ? [cell - 1, cell] : [cell];
}

/** Writes the ranges of the cells of one row of `count` texels into `row`. */
function rangesOfRow(texels: Uint8Array, from: number, count: number, row: Uint8Array): void {
  for (let i = 0, first = 0; i < row.length; i += 2, first += CELL) {
    const end = from + Math.min(count - 1, first + CELL);
    let low = texels[from + first];
    let high = low;
    for (let at = from + first + 1; at <= end; at++) {
      const value = texels[at];
      if (value < low) low = value;
      if (value > high) high = value;
    }
    row[i] = low;
    row[i + 1] = high;
  }
}

/** Widens the ranges from index `at` on, so that they contain those of `row`. */
function widen(ranges: Uint8Array, at: number, row: Uint8Array): void {
  for (let i = 0; i < row.length; i += 2) {
    if (row[i] < ranges[at + i]) ranges[at + i] = row[i];
    if (row[i + 1] > ranges[at + i + 1]) ranges[at + i + 1] = row[i + 1];
  }
}
