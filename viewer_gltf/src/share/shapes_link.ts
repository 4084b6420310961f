/**
 * Writes and reads the shapes of a two-dimensional transfer function in a link. Each has 21 characters: `r` or `t`;
 * lower and upper value, lower and upper gradient, tip, opacity and softness as two digits of base 36 each; and the
 * colour in sRGB. Pure.
 */

import { MAX_SHAPES, type Shape, type Shapes } from "../bundle/transfer_2d";
import { fromHex, toHex } from "../math/color";
import { onLattice, STEPS } from "../state/transfer_functions_2d";

const LENGTH = 21;

export function writeShapes(shapes: Shapes): string {
  return shapes
    .map(({ kind, values, gradients, tip, color, opacity, softness }) => {
      const numbers = [...values, ...gradients, tip, opacity, softness].map((value) =>
        Math.round(value * STEPS)
          .toString(36)
          .padStart(2, "0"),
      );
      return `${kind[0]}${numbers.join("")}${toHex(color).slice(1)}`;
    })
    .join("");
}

/** Reads shapes; null if they can't be read. */
export function readShapes(text: string): Shapes | null {
  if (text.length % LENGTH !== 0 || text.length > MAX_SHAPES * LENGTH) return null;
  const shapes = Array.from({ length: text.length / LENGTH }, (_, i) =>
    readShape(text.slice(i * LENGTH, (i + 1) * LENGTH)),
  );
  const read = shapes.flatMap((shape) => shape ?? []);
  return read.length === shapes.length ? read : null;
}

function readShape(text: string): Shape | null {
  if (!/^[rt][0-9a-z]{14}[0-9a-f]{6}$/.test(text)) return null;
  const at = (i: number) => Number.parseInt(text.slice(1 + 2 * i, 3 + 2 * i), 36) / STEPS;
  return onLattice({
    kind: text[0] === "r" ? "rectangle" : "triangle",
    values: [at(0), at(1)],
    gradients: [at(2), at(3)],
    tip: at(4),
    opacity: at(5),
    softness: at(6),
    color: fromHex(`#${text.slice(15)}`),
  });
}
