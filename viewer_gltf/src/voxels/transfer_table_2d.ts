/**
 * Lookup table of a two-dimensional transfer function: a table of value and gradient magnitude, and
 * a one-dimensional envelope for steps that need no gradient. Plain arrays, and the uniforms that
 * pass their numbers to gpu/chunks/transfer_table_2d.glsl.
 */
import { Vector4 } from "three";

import { ROWS, type Shapes, type Transfer2d } from "../bundle/transfer_2d";
import { rasterise } from "../state/transfer_shapes";
import { ENTRIES, lookUpTable } from "./transfer_luts";

const ROW = 4 * ENTRIES;

export type TransferTable2d = Readonly<{
  /** RGBA, ROWS x ENTRIES; row 0 is gradient 0. */
  cells: Uint8Array<ArrayBuffer>;
  /** The step of intensity that corresponds to the last row. */
  gradientMax: number;
  /**
   * The most opaque cell at each value, over all gradients: where it is empty, nothing is visible.
   */
  envelope: Uint8Array;
}>;

export const NO_ENTRIES = new Uint8Array(ROW);

export function tableUniforms() {
  return { uGradientMax: { value: new Vector4(1, 1, 1, 1) } };
}

/** Sets the uniforms from the channels' tables; null: a channel has no table. */
export function tablesInto(
  { uGradientMax }: ReturnType<typeof tableUniforms>,
  tables: readonly (TransferTable2d | null | undefined)[],
): void {
  tables.forEach((table, c) => void uGradientMax.value.setComponent(c, table?.gradientMax ?? 1));
}

/**
 * Makes the table of shapes in a window of the intensities. The window also scales the gradients.
 *
 * @param opacity factor of the shapes' own opacity
 */
export function transferTable2d(
  shapes: Shapes,
  { gradient_max }: Transfer2d,
  window: readonly [number, number],
  opacity: number,
): TransferTable2d {
  const whole = rasterise(shapes);
  tintEmpty(whole);
  const isWhole = window[0] === 0 && window[1] === 1 && opacity === 1;
  const cells = isWhole ? whole : new Uint8Array(whole.length);
  if (!isWhole) {
    for (let at = 0; at < whole.length; at += ROW) {
      cells.set(lookUpTable(whole.subarray(at, at + ROW), window, opacity), at);
    }
  }
  const gradient = gradient_max * (window[1] - window[0]);
  return { cells, gradientMax: gradient, envelope: envelopeOf(cells) };
}

/**
 * A one-dimensional function as a table: all rows are equal, since it does not depend on the
 * gradient.
 */
export function alikeRows(entries: Uint8Array): Uint8Array<ArrayBuffer> {
  const cells = new Uint8Array(ROWS * ROW);
  for (let at = 0; at < cells.length; at += ROW) cells.set(entries, at);
  return cells;
}

/** The most opaque cell at each value. */
export function envelopeOf<T extends Uint8Array | Float32Array>(cells: T): T {
  const envelope = cells.slice(0, ROW) as T;
  for (let at = ROW; at < cells.length; at += ROW) {
    for (let i = 0; i < ROW; i += 4) {
      if (cells[at + i + 3] <= envelope[i + 3]) continue;
      for (let k = 0; k < 4; k++) envelope[i + k] = cells[at + i + k];
    }
  }
  return envelope;
}

/**
 * Gives each empty cell the colour of the next cell of a shape. Empty cells are white, and cells
 * are interpolated before their opacity counts, so white would show beside a shape's hard edge.
 */
function tintEmpty(cells: Uint8Array): void {
  const tint = (to: number, from: number) => {
    for (let k = 0; k < 3; k++) cells[to + k] = cells[from + k];
  };
  for (let row = 0; row < cells.length; row += ROW) {
    for (let i = row; i < row + ROW; i += 4) {
      if (cells[i + 3] === 0) continue;
      if (i > row && cells[i - 1] === 0) tint(i - 4, i);
      if (i + 4 < row + ROW && cells[i + 7] === 0) tint(i + 4, i);
      if (row > 0 && cells[i - ROW + 3] === 0) tint(i - ROW, i);
      if (row + ROW < cells.length && cells[i + ROW + 3] === 0) tint(i + ROW, i);
    }
  }
}
