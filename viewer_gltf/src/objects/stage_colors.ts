/** Sample of the colours that the stage gives to objects, for a swatch. Pure, except for the use of three. */
import type { BufferGeometry } from "three";
import { type Rgb, toHex } from "../math/color";

/** Number of sampled vertices: enough to show that the objects have different colours. */
const COUNT = 8;

/** Returns the different colours of evenly spaced vertices of a surface; empty if it has no vertex colours. */
export function stageColors({ attributes: { color } }: BufferGeometry): readonly string[] {
  if (color === undefined) return [];
  const colors = Array.from({ length: COUNT }, (_, i): Rgb => {
    const at = Math.floor(((i + 0.5) / COUNT) * color.count);
    return [color.getX(at), color.getY(at), color.getZ(at)];
  });
  return [...new Set(colors.map(toHex))];
}
