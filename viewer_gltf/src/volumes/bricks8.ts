/** How many bricks of 8^3 texels a volume has along each axis. Pure. */
import type { Size3 } from "../bundle/ktx2";

/** Texels along an edge of a brick of which the least and the most intensity are known. */
export const SKIP_BRICK = 8;

export function brickCounts(size: Size3): Size3 {
  const [x, y, z] = size;
  return [Math.ceil(x / SKIP_BRICK), Math.ceil(y / SKIP_BRICK), Math.ceil(z / SKIP_BRICK)];
}
