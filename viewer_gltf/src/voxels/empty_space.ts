/**
 * Where a ray may skip: for each brick of SKIP_BRICK^3 texels, the distance to the nearest brick in
 * which the transfer functions show anything. Plain arrays.
 *
 * The distance is Chebyshev's, in bricks, by the two-pass chamfer transform (Rosenfeld & Pfaltz
 * 1968), which is exact for it. Skipping by distances: Cohen & Sheffer, "Proximity clouds", The
 * Visual Computer 1994.
 */
import type { Size3 } from "../bundle/ktx2";

/** Smallest opacity that is drawn, in steps of 8 bits. */
const INVISIBLE = 0.5;
export const FAR = 255;

/** Input of an empty-space table: entry c of `bricks` and of `alphas` belongs to channel c. */
export type OccupancyRequest = Readonly<{
  /** Smallest and largest intensity of each brick, interleaved. */
  bricks: readonly Uint8Array[];
  /**
   * The transfer function's opacity, 0 to 255, at each of 256 intensities: the largest over all
   * gradients.
   */
  alphas: readonly Uint8Array[];
  /** Bricks along x, y, z. */
  count: Size3;
}>;

/**
 * Largest opacity, 0 to 255, between intensities lo and hi, for each lo <= hi, at index lo * 256 +
 * hi.
 */
export function opacityRanges(alpha: Uint8Array): Uint8Array {
  const ranges = new Uint8Array(256 * 256);
  for (let lo = 0; lo < 256; lo++) {
    let largest = 0;
    for (let hi = lo; hi < 256; hi++) {
      largest = Math.max(largest, alpha[hi]);
      ranges[lo * 256 + hi] = largest;
    }
  }
  return ranges;
}

/**
 * Marks in `visible` (one byte for each brick) the bricks in which a channel shows something.
 *
 * @param bricks smallest and largest intensity of each brick, interleaved
 * @param ranges of the channel's transfer function, from `opacityRanges`
 */
export function markVisible(visible: Uint8Array, bricks: Uint8Array, ranges: Uint8Array): void {
  for (let i = 0; i < visible.length; i++) {
    const opacity = ranges[bricks[2 * i] * 256 + bricks[2 * i + 1]];
    visible[i] |= opacity > INVISIBLE ? 1 : 0;
  }
}

/** Distance of each brick to the nearest visible one: 0 in a visible brick, at most FAR. */
export function brickDistances(visible: Uint8Array, size: Size3): Uint8Array<ArrayBuffer> {
  const [nx, ny, nz] = size;
  // A border of FAR bricks saves all tests for the volume's edge.
  const row = nx + 2;
  const plane = row * (ny + 2);
  const padded = new Uint8Array(plane * (nz + 2)).fill(FAR);
  for (let z = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) {
      const from = (z * ny + y) * nx;
      const to = (z + 1) * plane + (y + 1) * row + 1;
      for (let x = 0; x < nx; x++) padded[to + x] = visible[from + x] === 0 ? FAR : 0;
    }
  }
  for (let z = 1; z <= nz; z++) {
    for (let y = 1; y <= ny; y++) relaxRow(padded, z * plane + y * row, nx, row, plane, 1);
  }
  for (let z = nz; z >= 1; z--) {
    for (let y = ny; y >= 1; y--) {
      relaxRow(padded, z * plane + y * row + nx + 1, nx, row, plane, -1);
    }
  }
  const distance = new Uint8Array(visible.length);
  for (let z = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) {
      const from = (z + 1) * plane + (y + 1) * row + 1;
      distance.set(padded.subarray(from, from + nx), (z * ny + y) * nx);
    }
  }
  return distance;
}

/**
 * Updates a row from the 13 neighbours that the sweep has passed. In the four passed rows, the
 * smallest value of each column is taken first, so that three columns stand for twelve bricks.
 *
 * @param start the border brick from which the sweep starts; `step` 1 or -1 leads along the row
 */
function relaxRow(
  padded: Uint8Array,
  start: number,
  count: number,
  row: number,
  plane: number,
  step: 1 | -1,
): void {
  const backRow = -step * row;
  const backPlane = -step * plane;
  const least = (at: number) => {
    const a = Math.min(padded[at + backRow], padded[at + backPlane]);
    const b = Math.min(padded[at + backPlane + row], padded[at + backPlane - row]);
    return Math.min(a, b);
  };
  let here = start + step;
  let before = least(start);
  let middle = least(here);
  let nearest = FAR;
  for (let i = 0; i < count; i++, here += step) {
    const after = least(here + step);
    const passed = Math.min(before, middle, after, nearest) + 1;
    nearest = Math.min(padded[here], passed);
    padded[here] = nearest;
    before = middle;
    middle = after;
  }
}

/** The distances of one tile's bricks under its channels' transfer functions. */
export function occupancyDistances(request: OccupancyRequest): Uint8Array<ArrayBuffer> {
  const { bricks, alphas, count } = request;
  const visible = new Uint8Array(count[0] * count[1] * count[2]);
  bricks.forEach((channel, c) => {
    if (channel.length !== 2 * visible.length || alphas[c]?.length !== 256) {
      throw new RangeError(
        `channel ${c}: found ${channel.length} bytes of bricks and ${alphas[c]?.length ?? 0} opacities; ` +
          `expected ${2 * visible.length} bytes and 256 opacities`,
      );
    }
    markVisible(visible, channel, opacityRanges(alphas[c]));
  });
  return brickDistances(visible, count);
}
