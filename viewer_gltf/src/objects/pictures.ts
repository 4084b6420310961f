/** The panel's pictures of a table: the histogram of a column, its categories, and the scatter plot of two columns. */
import type { ObjectColumn } from "../bundle/generated/objects";
import type { ObjectView } from "../state/objects";
import { GONE, SELECTED } from "./flags";
import { byteValue } from "./palettes";
import type { ObjectTable } from "./table";

type Context = CanvasRenderingContext2D;

const BINS = 64;
/** The page's colours, as in panel/html/colors.css. */
const [INK, LINE, TEXT, DIM] = ["#0b0d12", "#3a4458", "#e6e9f0", "#a3adbd"];
const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif";
/** Largest number of points in a scatter plot; more would cover one another. */
const MAX_POINTS = 20_000;

/** Returns the horizontal position of a byte, 1 to 255, as a share of a picture's width. */
export const placeOf = (byte: number) => (byte - 1) / 254;
export const byteAt = (place: number) => Math.round(1 + 254 * Math.min(1, Math.max(0, place)));

/** Writes a number with three digits, such as 12.3 or 1 230; very large and small ones as 4.50e6. */
export function numberText(value: number): string {
  if (!Number.isFinite(value)) return "";
  const size = Math.abs(value);
  if (size >= 1e6 || (size < 1e-3 && size > 0)) return value.toExponential(2).replace("e+", "e");
  const digits = size >= 100 ? 0 : Math.max(0, 2 - Math.floor(Math.log10(size || 1)));
  return Number(value.toFixed(digits)).toLocaleString("en").replaceAll(",", " ");
}

export function unitText(unit: string): string {
  return unit.replace(/^um/, "µm").replace(/3$/, "³").replace(/2$/, "²");
}

/** Counts the rows for each of the 256 byte values: all rows, and the rows of shown objects. */
export function countBytes(
  bytes: Uint8Array,
  flags: Uint8Array,
): readonly [all: Uint32Array, left: Uint32Array] {
  const all = new Uint32Array(256);
  const left = new Uint32Array(256);
  for (let row = 0; row < bytes.length; row++) {
    all[bytes[row]]++;
    if (flags[row] !== GONE) left[bytes[row]]++;
  }
  return [all, left];
}

const css = (colors: Uint8Array, byte: number) =>
  `rgb(${colors[4 * byte]} ${colors[4 * byte + 1]} ${colors[4 * byte + 2]})`;

/**
 * Draws the histogram of a column of numbers, with shown objects in their colours and hidden ones in grey. Two lines
 * mark the ends of the shown range, and the palette is drawn below.
 */
export function drawHistogram(
  context: Context,
  width: number,
  height: number,
  column: ObjectColumn,
  counts: readonly [Uint32Array, Uint32Array],
  colors: Uint8Array,
  brush: readonly [number, number],
): void {
  const foot = Math.round(0.3 * height);
  const tall = height - foot;
  context.fillStyle = INK;
  context.fillRect(0, 0, width, tall);
  const binned = counts.map((each) => {
    const bins = new Array<number>(BINS).fill(0);
    for (let byte = 1; byte < 256; byte++) bins[((byte - 1) * BINS) >> 8] += each[byte];
    return bins;
  });
  const most = Math.max(1, ...binned[0]);
  const heightOf = (count: number) =>
    count === 0 ? 0 : Math.max(2, tall * Math.sqrt(count / most));
  for (let bin = 0; bin < BINS; bin++) {
    const x = (bin / BINS) * width;
    const bar = (count: number, fill: string) => {
      context.fillStyle = fill;
      context.fillRect(x, tall - heightOf(count), width / BINS - 1, heightOf(count));
    };
    bar(binned[0][bin], LINE);
    bar(binned[1][bin], css(colors, 1 + Math.floor(((bin + 0.5) / BINS) * 255)));
  }
  for (let i = 0; i < 128; i++) {
    context.fillStyle = css(colors, byteAt(i / 127));
    context.fillRect((i / 128) * width, tall + 2, width / 128 + 1, 0.2 * foot);
  }
  context.fillStyle = TEXT;
  for (const byte of brush) context.fillRect(placeOf(byte) * (width - 3), 0, 3, tall + 0.2 * foot);
  const { range, unit } = column;
  if (range === undefined) return;
  context.font = `500 ${Math.round(0.48 * foot)}px ${FONT}`;
  context.textBaseline = "bottom";
  const places = [
    ["left", 0, 1],
    ["center", 0.5, 128],
    ["right", 1, 255],
  ] as const;
  for (const [align, at, byte] of places) {
    context.textAlign = align;
    context.fillStyle = DIM;
    const words = numberText(byteValue(range, byte));
    context.fillText(at === 1 ? `${words} ${unitText(unit)}`.trim() : words, at * width, height);
  }
}

/** Largest number of legend rows that stays readable, also on the panel in a headset. */
export const ROWS_OF_LEGEND = 10;
/** Legend's text for objects without a category. */
export const NO_CATEGORY = "(none)";

/** Returns one page of a legend: indices of categories, with -1 at the very end for objects without a category. */
export function legendOf(
  { categories }: Readonly<{ categories?: readonly string[] }>,
  hasMissing: boolean,
  wanted: number,
): Readonly<{ indices: readonly number[]; page: number; pages: number; count: number }> {
  const all = [...(categories ?? []).keys(), ...(hasMissing ? [-1] : [])];
  const pages = Math.max(1, Math.ceil(all.length / ROWS_OF_LEGEND));
  const page = Math.min(wanted, pages - 1); // the column shown before may have had more pages
  const first = page * ROWS_OF_LEGEND;
  return { indices: all.slice(first, first + ROWS_OF_LEGEND), page, pages, count: all.length };
}

/** Draws a row for each category: its colour, name and count. Categories that are left out are dim. */
export function drawCategories(
  context: Context,
  width: number,
  height: number,
  categories: readonly Readonly<{ index: number; name: string }>[],
  [all, left]: readonly [Uint32Array, Uint32Array],
  colors: Uint8Array,
  without: readonly number[],
): void {
  const row = height / categories.length;
  const size = Math.round(0.55 * row);
  context.font = `500 ${size}px ${FONT}`;
  context.textBaseline = "middle";
  categories.forEach(({ index, name }, i) => {
    const byte = index + 1;
    const isOut = without.includes(index);
    const y = i * row;
    context.globalAlpha = isOut ? 0.35 : 1;
    context.fillStyle = css(colors, byte);
    context.fillRect(0, y + 0.15 * row, 0.9 * row, 0.7 * row);
    context.fillStyle = TEXT;
    context.textAlign = "left";
    context.fillText(name, 1.2 * row, y + row / 2, 0.62 * width);
    context.textAlign = "right";
    context.fillStyle = DIM;
    context.fillText(`${left[byte]} of ${all[byte]}`, width, y + row / 2);
    context.globalAlpha = 1;
  });
}

/** Returns the index of the category whose row lies at a share of the picture's height from the top. */
export function categoryAt(indices: readonly number[], down: number): number {
  const i = Math.floor(down * indices.length);
  return indices[Math.min(indices.length - 1, Math.max(0, i))];
}

/** Draws a point for each shown object, with a light rim if it is selected, and the lasso. */
export function drawScatter(
  context: Context,
  width: number,
  height: number,
  table: ObjectTable,
  view: ObjectView,
  flags: Uint8Array,
  [xs, ys]: readonly [Uint8Array, Uint8Array],
  colorOf: (row: number) => string,
): void {
  context.fillStyle = INK;
  context.fillRect(0, 0, width, height);
  const dot = Math.max(2, width / (table.count > 2000 ? 220 : 90));
  const step = Math.max(1, Math.ceil(table.count / MAX_POINTS));
  const put = (row: number, by: number) =>
    context.fillRect(
      placeOf(xs[row]) * (width - dot) - by,
      (1 - placeOf(ys[row])) * (height - dot) - by,
      dot + 2 * by,
      dot + 2 * by,
    );
  for (let row = 0; row < table.count; row += step) {
    if (flags[row] === GONE || xs[row] === 0 || ys[row] === 0) continue;
    context.fillStyle = TEXT;
    if (flags[row] >= SELECTED) put(row, 1.5);
    context.fillStyle = colorOf(row);
    put(row, 0);
  }
  if (view.lasso.length < 2) return;
  context.beginPath();
  view.lasso.forEach(([x, y], i) => {
    if (i === 0) context.moveTo(x * width, y * height);
    else context.lineTo(x * width, y * height);
  });
  context.closePath();
  context.strokeStyle = TEXT;
  context.lineWidth = 2;
  context.stroke();
}

/** Returns the rows of shown objects whose points lie in the lasso. */
export function inLasso(
  lasso: ObjectView["lasso"],
  flags: Uint8Array,
  [xs, ys]: readonly [Uint8Array, Uint8Array],
): readonly number[] {
  const rows: number[] = [];
  for (let row = 0; row < flags.length; row++) {
    if (flags[row] === GONE || xs[row] === 0 || ys[row] === 0) continue;
    if (isInside(lasso, placeOf(xs[row]), 1 - placeOf(ys[row]))) rows.push(row);
  }
  return rows;
}

/** Returns whether a point lies in a polygon, which is the case if an odd number of edges lies to its right. */
function isInside(corners: ObjectView["lasso"], x: number, y: number): boolean {
  let inside = false;
  corners.forEach(([ax, ay], i) => {
    const [bx, by] = corners[(i + 1) % corners.length];
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  });
  return inside;
}
