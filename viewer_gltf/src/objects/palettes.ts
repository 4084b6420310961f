/** Tables of 256 colours, one for each byte of a column. Colour-blind people can read all palettes. Pure. */
import type { ColumnRange, ObjectColumn } from "../bundle/generated/objects";
import { fromHex, type Rgb, toHex } from "../math/color";
import type { ObjectView, PaletteName } from "../state/objects";

/**
 * Evenly spaced sRGB colours of each palette: matplotlib's viridis and magma, cividis (Nuñez et al. 2018,
 * doi:10.1371/journal.pone.0199239) and ColorBrewer's RdYlBu.
 */
const STOPS: Readonly<Record<PaletteName, string>> = {
  viridis: "440154 482878 3e4989 31688e 26828e 1f9e89 35b779 6ece58 b5de2b fde725",
  cividis: "00224e 123570 3b496c 575d6d 707173 8a8678 a59c74 c3b369 e1cc55 fee838",
  magma: "1c1044 3b0f70 641a80 8c2981 b73779 de4968 f7705c fe9f6d fecf92 fcfdbf",
  diverging: "313695 4575b4 74add1 abd9e9 e0f3f8 ffffbf fee090 fdae61 f46d43 d73027 a50026",
};
/** sRGB colours for categories without a stated colour: those of Okabe and Ito, without black. */
const DISTINCT = "e69f00 56b4e9 009e73 f0e442 0072b2 d55e00 cc79a7".split(" ");
/** Linear colour of objects without a value. */
export const MISSING: Rgb = [0.13, 0.13, 0.14];

const stops = new Map<PaletteName, readonly Rgb[]>();

/** Returns the linear colour at a position in the palette; 0 is the first colour and 1 the last. */
export function colorAt(palette: PaletteName, share: number): Rgb {
  const list = stops.get(palette) ?? STOPS[palette].split(" ").map((hex) => fromHex(`#${hex}`));
  stops.set(palette, list);
  const at = Math.min(1, Math.max(0, share)) * (list.length - 1);
  const i = Math.min(list.length - 2, Math.floor(at));
  const [a, b] = [list[i], list[i + 1]];
  const mixed = (k: 0 | 1 | 2) => a[k] + (at - i) * (b[k] - a[k]);
  return [mixed(0), mixed(1), mixed(2)];
}

/** Returns the value that a byte from 1 to 255 stands for; byte 0 means that there is no value. */
export function byteValue({ low, high, scale }: ColumnRange, byte: number): number {
  const share = (byte - 1) / 254;
  return scale === "log" ? low * (high / low) ** share : low + share * (high - low);
}

/** Returns the byte, 1 to 255, whose value is nearest to a value. */
export function byteOf({ low, high, scale }: ColumnRange, value: number): number {
  if (high <= low) return 1;
  const share =
    scale === "log" ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.round(1 + 254 * Math.min(1, Math.max(0, share || 0)));
}

/** Returns whether the palette is spread over the logarithm of the values; never if the column's range reaches 0 or less. */
export function isLogarithmic(
  { range }: ObjectColumn,
  { isLog }: Pick<ObjectView, "isLog">,
): boolean {
  if (range === undefined || range.low <= 0) return false;
  return isLog ?? range.scale === "log";
}

export function categoryColor({ colors = [] }: ObjectColumn, index: number): Rgb {
  return colors[index] ?? fromHex(`#${DISTINCT[index % DISTINCT.length]}`);
}

/** Returns 256 sRGB colours with alpha, 4 bytes for each byte of the column; colour 0 is for missing values. */
export function tableOf(
  column: ObjectColumn,
  view: Pick<ObjectView, "palette" | "span" | "isLog">,
): Uint8Array<ArrayBuffer> {
  const table = new Uint8Array(256 * 4);
  const put = (byte: number, color: Rgb) => {
    const hex = Number.parseInt(toHex(color).slice(1), 16);
    table.set([hex >> 16, (hex >> 8) & 255, hex & 255, 255], 4 * byte);
  };
  put(0, MISSING);
  const { range } = column;
  for (let byte = 1; byte < 256; byte++) {
    if (column.kind === "category") put(byte, categoryColor(column, byte - 1));
    else if (range !== undefined)
      put(byte, colorAt(view.palette, shareOf(column, range, view, byte)));
  }
  return table;
}

/** Returns the position of a byte in the palette; 0 and 1 are the ends of the view's span. */
function shareOf(
  column: ObjectColumn,
  range: ColumnRange,
  view: Pick<ObjectView, "span" | "isLog">,
  byte: number,
): number {
  const isLog = isLogarithmic(column, view);
  const scaled = (each: number) => {
    const value = byteValue(range, each);
    return isLog ? Math.log(value) : value;
  };
  const [from, to] = view.span.map(scaled);
  return to > from ? (scaled(byte) - from) / (to - from) : 0.5;
}
