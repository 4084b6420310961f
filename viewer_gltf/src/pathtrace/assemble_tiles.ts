/**
 * Assembles all tiles of a specimen into one block of texels, and finds the value range of its bricks. Pure arrays.
 * All tiles share one lattice, and each has an apron with the texels of its neighbours. Where tiles overlap, they
 * therefore have equal texels.
 */

import { SKIP_BRICK } from "../bundle/generated/constants";
import type { Size3 } from "../bundle/ktx2";
import { brickCounts } from "../voxels/skip_bricks";

/**
 * One mip level of a tile, channels interleaved, x fastest. `at` is the first texel of the tile in
 * the block, and `whole` is the tile's size, both in texels (x, y, z) of the finest mip level.
 */
export type Part = Readonly<{ at: Size3; whole: Size3; size: Size3; texels: Uint8Array }>;

/** The block into which tiles are pasted. */
export type Block = Readonly<{
  size: Size3;
  /** Bytes per texel. */
  stride: number;
  texels: Uint8Array<ArrayBuffer>;
}>;

export function emptyBlock(size: Size3, stride: number): Block {
  return { size, stride, texels: new Uint8Array(size[0] * size[1] * size[2] * stride) };
}

/**
 * Writes a tile into the block, which is one level of a block with `finest` texels. At coarser levels the texels of
 * tiles and block do not coincide, and each texel of the block takes the nearest one of the tile.
 */
export function paste({ size, stride, texels }: Block, finest: Size3, part: Part): void {
  const [xs, ys, zs] = [0, 1, 2].map((k) => axisOf(size[k], finest[k], part, k));
  for (const [z, fromZ] of zs) {
    for (const [y, fromY] of ys) {
      const row = (fromZ * part.size[1] + fromY) * part.size[0];
      const into = (z * size[1] + y) * size[0];
      for (const [x, fromX] of xs) {
        const [to, from] = [(into + x) * stride, (row + fromX) * stride];
        for (let c = 0; c < stride; c++) texels[to + c] = part.texels[from + c];
      }
    }
  }
}

/**
 * Returns the block's texels along an axis that lie in a tile, each with the nearest texel of that
 * tile.
 */
function axisOf(count: number, finest: number, { at, whole, size }: Part, k: number) {
  const pairs: [number, number][] = [];
  for (let i = 0; i < count; i++) {
    const inside = ((i + 0.5) / count) * finest - at[k];
    if (inside < 0 || inside >= whole[k]) continue;
    pairs.push([i, Math.min(size[k] - 1, Math.floor((inside / whole[k]) * size[k]))]);
  }
  return pairs;
}

/**
 * Returns the smallest and largest value of every brick of SKIP_BRICK^3 texels of one channel, interleaved. A brick that
 * begins at texel i covers [i - 1, i + SKIP_BRICK], which are all texels that a trilinear sample inside it can read.
 */
export function brickRanges(
  { size, stride, texels }: Block,
  channel: number,
): Uint8Array<ArrayBuffer> {
  const counts = brickCounts(size);
  const [bx, by, bz] = counts;
  const ranges = new Uint8Array(2 * bx * by * bz);
  for (let i = 0; i < ranges.length; i += 2) ranges[i] = 255;
  const row = new Uint8Array(2 * bx);
  for (let z = 0; z < size[2]; z++) {
    for (let y = 0; y < size[1]; y++) {
      rowRanges(texels, (z * size[1] + y) * size[0] * stride + channel, stride, size[0], row);
      for (const k of readers(z, bz)) {
        for (const j of readers(y, by)) widen(ranges, 2 * (k * by + j) * bx, row);
      }
    }
  }
  return ranges;
}

/** Writes the ranges of one row's bricks, interleaved, into `row`. */
function rowRanges(texels: Uint8Array, from: number, stride: number, n: number, row: Uint8Array) {
  for (let b = 0; 2 * b < row.length; b++) {
    let low = 255;
    let high = 0;
    const first = SKIP_BRICK * b;
    const last = Math.min(n - 1, first + SKIP_BRICK);
    for (let x = Math.max(0, first - 1); x <= last; x++) {
      const value = texels[from + x * stride];
      if (value < low) low = value;
      if (value > high) high = value;
    }
    row[2 * b] = low;
    row[2 * b + 1] = high;
  }
}

function widen(ranges: Uint8Array, to: number, row: Uint8Array): void {
  for (let i = 0; i < row.length; i += 2) {
    if (row[i] < ranges[to + i]) ranges[to + i] = row[i];
    if (row[i + 1] > ranges[to + i + 1]) ranges[to + i + 1] = row[i + 1];
  }
}

/** Returns the bricks along an axis whose range includes a texel. */
function readers(texel: number, count: number): readonly number[] {
  const brick = Math.floor(texel / SKIP_BRICK);
  const inside = texel % SKIP_BRICK;
  const found = [brick];
  if (inside === 0 && brick > 0) found.push(brick - 1);
  if (inside === SKIP_BRICK - 1 && brick + 1 < count) found.push(brick + 1);
  return found;
}

/** The tiles that a worker assembles: see `assemble_worker.ts`. */
export type AssembleRequest = Readonly<{
  id: number;
  size: Size3;
  finest: Size3;
  stride: number;
  channels: number;
  parts: readonly Part[];
}>;

export type Assembled = Readonly<{
  id: number;
  texels: Uint8Array<ArrayBuffer>;
  /** Ranges of the bricks of each channel: see `brickRanges`. */
  bricks: readonly Uint8Array<ArrayBuffer>[];
}>;

export function assemble({
  id,
  size,
  finest,
  stride,
  channels,
  parts,
}: AssembleRequest): Assembled {
  const block = emptyBlock(size, stride);
  for (const part of parts) paste(block, finest, part);
  const bricks = Array.from({ length: channels }, (_, c) => brickRanges(block, c));
  return { id, texels: block.texels, bricks };
}
