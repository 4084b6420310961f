/** Number of bricks of SKIP_BRICK^3 texels along each axis of a volume. */
import { SKIP_BRICK } from "../bundle/generated/constants";
import type { Size3 } from "../bundle/ktx2";

export function brickCounts(size: Size3): Size3 {
  const [x, y, z] = size;
  return [Math.ceil(x / SKIP_BRICK), Math.ceil(y / SKIP_BRICK), Math.ceil(z / SKIP_BRICK)];
}
