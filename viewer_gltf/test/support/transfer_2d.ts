import { COLUMNS, ROWS, type Shape } from "../../src/bundle/transfer_2d";
import { makeShape } from "../../src/state/transfer_shapes";

export function randomShapes(random: () => number): readonly Shape[] {
  return Array.from({ length: 1 + Math.floor(4 * random()) }, (_, i) => ({
    ...makeShape(i % 2 ? "triangle" : "rectangle", { value: random(), gradient: random() }),
    softness: random() < 0.3 ? 0 : random(),
    opacity: random(),
  }));
}

/** Samples a table like the GPU, linearly between cells. */
export function sampled(
  cells: ArrayLike<number>,
  value: number,
  gradient: number,
  part: number,
): number {
  const [x, y] = [value * (COLUMNS - 1), gradient * (ROWS - 1)];
  const [left, below] = [Math.min(COLUMNS - 2, Math.floor(x)), Math.min(ROWS - 2, Math.floor(y))];
  const at = (j: number, k: number) => cells[4 * (j * COLUMNS + k) + part];
  const row = (j: number) => at(j, left) + (at(j, left + 1) - at(j, left)) * (x - left);
  return row(below) + (row(below + 1) - row(below)) * (y - below);
}
