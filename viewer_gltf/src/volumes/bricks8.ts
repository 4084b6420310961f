/** How many bricks of 8^3 texels a volume has along each axis. Pure. */
import type { Size3 } from "../bundle/ktx2";

export const BRICK = 8;

export function brickCounts(size: Size3): Size3 {
  const [x, y, z] = size;
  return [Math.ceil(x / BRICK), Math.ceil(y / BRICK), Math.ceil(z / BRICK)];
}
