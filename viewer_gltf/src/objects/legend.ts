/** The legend of the objects' colours, for saved images and other views without a panel. Pure. */
import type { ObjectColumn } from "../bundle/generated/objects";
import type { ColorLegend } from "../host/services";
import { toHex } from "../math/color";
import type { ObjectView } from "../state/objects";
import { byteValue, categoryColor, colorAt, isLogarithmic, MISSING } from "./palettes";
import { countBytes, NO_CATEGORY, numberText, ROWS_OF_LEGEND, unitText } from "./pictures";

/** Number of colours in the legend's strip of a palette. */
const PALETTE_COLORS = 17;

/**
 * Returns the legend of a column for the shown objects. A column of categories lists the first ones and counts the
 * rest; a column of numbers has its palette with the values at both ends.
 */
export function colorLegend(
  column: ObjectColumn,
  bytes: Uint8Array,
  flags: Uint8Array,
  view: Pick<ObjectView, "palette" | "span" | "isLog">,
): ColorLegend {
  const [, left] = countBytes(bytes, flags);
  const rows =
    column.kind === "category" ? categoryRows(column, left) : numberRows(column, left[0], view);
  return { column: column.name, rows };
}

function categoryRows(column: ObjectColumn, left: Uint32Array): ColorLegend["rows"] {
  const { categories = [] } = column;
  const shown = [...categories.keys(), -1].filter((index) => left[index + 1] > 0);
  const rows = shown.slice(0, ROWS_OF_LEGEND).map((index) => ({
    colors: [toHex(index < 0 ? MISSING : categoryColor(column, index))],
    text: categories[index] ?? NO_CATEGORY,
  }));
  const more = shown.length - rows.length;
  return more === 0 ? rows : [...rows, { colors: [], text: `and ${more} more` }];
}

/** @param missing number of shown objects without a value */
function numberRows(
  column: ObjectColumn,
  missing: number,
  view: Pick<ObjectView, "palette" | "span" | "isLog">,
): ColorLegend["rows"] {
  const { range, unit } = column;
  const none = missing === 0 ? [] : [{ colors: [toHex(MISSING)], text: NO_CATEGORY }];
  if (range === undefined) return none;
  const [low, high] = view.span.map((byte) => numberText(byteValue(range, byte)));
  const ends = `${low} – ${high} ${unitText(unit)}`.trim();
  const colors = Array.from({ length: PALETTE_COLORS }, (_, i) =>
    toHex(colorAt(view.palette, i / (PALETTE_COLORS - 1))),
  );
  const text = isLogarithmic(column, view) ? `${ends}, logarithmic` : ends;
  return [{ colors, text }, ...none];
}
