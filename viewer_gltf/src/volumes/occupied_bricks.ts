/** Where a channel shows something in a volume, by the ranges of its bricks. Pure. */
import type { Size3 } from "../bundle/ktx2";
import type { Vec3 } from "../math/vec3";

/** Of the part of a brick that is taken for full: a surface goes through the middle of those it meets. */
const [FROM, TO] = [0.25, 0.75];

/**
 * Corners, in bricks, of the outermost bricks of every row that show something half-way through their range. Specks,
 * as of noise, which one voxel of many has, don't count.
 *
 * @param ranges smallest and largest intensity of every brick, interleaved
 * @param opacities 0..255, at each of 256 intensities
 */
export function occupiedCorners(
  ranges: Uint8Array,
  opacities: Uint8Array,
  [nx, ny, nz]: Size3,
): readonly Vec3[] {
  const found: Vec3[] = [];
  for (let z = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) {
      const at = (z * ny + y) * nx;
      const isFull = (x: number) =>
        opacities[(ranges[2 * (at + x)] + ranges[2 * (at + x) + 1]) >> 1] > 0;
      let [first, last] = [0, nx - 1];
      while (first < nx && !isFull(first)) first++;
      if (first === nx) continue;
      while (!isFull(last)) last--;
      for (const x of [first + FROM, last + TO]) {
        for (const dy of [FROM, TO]) {
          for (const dz of [FROM, TO]) found.push([x, y + dy, z + dz]);
        }
      }
    }
  }
  return found;
}
