/**
 * Where a ray may leap: for every brick of 8^3 texels, how far the nearest brick lies in which the
 * transfer functions show anything. Pure arrays.
 *
 * The distance is Chebyshev's, in bricks, by the two-pass chamfer transform (Rosenfeld & Pfaltz
 * 1968), which is exact for it. The idea of leaping by it: Cohen & Sheffer, "Proximity clouds",
 * The Visual Computer 1994.
 */
import type { Size3 } from "./ktx2";

/** Opacity below half a step of 8 bits is not drawn. */
const INVISIBLE = 0.5;
export const FAR = 255;

/** Largest opacity (0..255) between intensities lo and hi, for every lo <= hi: index lo * 256 + hi. */
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
 * Mark in `visible` (one byte a brick) the bricks in which a channel shows something.
 *
 * @param bricks smallest and largest intensity of every brick, interleaved
 * @param ranges of the channel's transfer function, from `opacityRanges`
 */
export function markVisible(visible: Uint8Array, bricks: Uint8Array, ranges: Uint8Array): void {
  for (let i = 0; i < visible.length; i++) {
    if (ranges[bricks[2 * i] * 256 + bricks[2 * i + 1]] > INVISIBLE) visible[i] = 1;
  }
}

/** Distance of each brick to the nearest visible one: 0 in a visible one, at most FAR. */
export function brickDistances(visible: Uint8Array, size: Size3): Uint8Array<ArrayBuffer> {
  const [nx, ny, nz] = size;
  const distance = new Uint8Array(visible.length);
  for (let i = 0; i < visible.length; i++) distance[i] = visible[i] ? 0 : FAR;
  const relax = (x: number, y: number, z: number, sign: number) => {
    const here = (z * ny + y) * nx + x;
    let nearest = distance[here];
    for (let dz = -1; dz <= 0; dz++) {
      for (let dy = -1; dy <= 1; dy++) {
        for (let dx = -1; dx <= 1; dx++) {
          // Only the 13 neighbours that the sweep has passed.
          if (dz === 0 && (dy > 0 || (dy === 0 && dx >= 0))) continue;
          const [px, py, pz] = [x + sign * dx, y + sign * dy, z + sign * dz];
          if (px < 0 || py < 0 || pz < 0 || px >= nx || py >= ny || pz >= nz) continue;
          nearest = Math.min(nearest, distance[(pz * ny + py) * nx + px] + 1);
        }
      }
    }
    distance[here] = nearest;
  };
  for (let z = 0; z < nz; z++)
    for (let y = 0; y < ny; y++) for (let x = 0; x < nx; x++) relax(x, y, z, 1);
  for (let z = nz - 1; z >= 0; z--)
    for (let y = ny - 1; y >= 0; y--) for (let x = nx - 1; x >= 0; x--) relax(x, y, z, -1);
  return distance;
}
