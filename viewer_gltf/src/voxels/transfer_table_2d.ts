/**
 * What a march looks up for a two-dimensional transfer function: a table of value and gradient
 * magnitude, and what stands for it where gradients are not asked for. Pure arrays, and the uniforms
 * that hand their numbers to gpu/chunks/transfer_table_2d.glsl.
 */
import { Vector4 } from "three";

import { ROWS, type Shapes, type Transfer2d } from "../bundle/transfer_2d";
import { rasterise } from "../state/transfer_shapes";
import { ENTRIES, lookUpTable } from "./transfer_luts";

const ROW = 4 * ENTRIES;

export type TransferTable2d = Readonly<{
  /** RGBA, ROWS x ENTRIES, row 0 is gradient 0. */
  cells: Uint8Array<ArrayBuffer>;
  /** The step of intensity that is the last row. */
  gradientMax: number;
  /** Of each value the most opaque cell, whatever its gradient: nothing shows that this does not. */
  envelope: Uint8Array;
}>;

export const NO_ENTRIES = new Uint8Array(ROW);

/** An entry for each channel. */
export function tableUniforms() {
  return { uGradientMax: { value: new Vector4(1, 1, 1, 1) } };
}

/** Set what `tableUniforms` made by the channels' tables; null: a channel has none. */
export function tablesInto(
  { uGradientMax }: ReturnType<typeof tableUniforms>,
  tables: readonly (TransferTable2d | null | undefined)[],
): void {
  tables.forEach((table, c) => void uGradientMax.value.setComponent(c, table?.gradientMax ?? 1));
}

/**
 * The table of shapes in a window of the intensities, which divides the steps of intensity too.
 *
 * @param opacity factor to the shapes' own
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

/** A one-dimensional function as a table: all gradients are alike to it. */
export function alikeRows(entries: Uint8Array): Uint8Array<ArrayBuffer> {
  const cells = new Uint8Array(ROWS * ROW);
  for (let at = 0; at < cells.length; at += ROW) cells.set(entries, at);
  return cells;
}

/** Of each value the most opaque cell. */
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
 * An empty cell is white, which would show beside a shape's hard edge, as cells are blended before
 * their opacity counts: it takes the colour of the next cell of a shape.
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
