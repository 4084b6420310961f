/** Where a channel shows something in a volume, from the ranges of its bricks. */
import type { Size3 } from "../bundle/ktx2";
import type { Vec3 } from "../math/vec3";

/**
 * Shares of a brick's edge between which the brick counts as occupied. A surface passes, on average,
 * through the middle of its bricks.
 */
const [FROM, TO] = [0.25, 0.75];

/**
 * Returns the corners, in bricks, of the outermost bricks of each row in which the middle of the
 * range is visible. Specks, such as a single voxel of noise, do not count.
 *
 * @param ranges smallest and largest intensity of each brick, interleaved
 * @param opacities 0 to 255, at each of 256 intensities
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
