/** The colours that objects have from the stage, as far as a swatch has room for them. Pure but for three. */
import type { BufferGeometry } from "three";
import { type Rgb, toHex } from "../math/color";

/** Enough to say that objects have colours of their own. */
const COUNT = 8;

/** Of a surface with colours at its vertices, evenly through it; none: it has none. */
export function stageColors({ attributes: { color } }: BufferGeometry): readonly string[] {
  if (color === undefined) return [];
  const colors = Array.from({ length: COUNT }, (_, i): Rgb => {
    const at = Math.floor(((i + 0.5) / COUNT) * color.count);
    return [color.getX(at), color.getY(at), color.getZ(at)];
  });
  return [...new Set(colors.map(toHex))];
}
