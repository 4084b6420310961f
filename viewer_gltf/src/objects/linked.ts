/**
 * Writes the view of a label map's objects into a link, and reads it from one. A later build of the same data may have
 * other rows and bytes. Therefore a link names objects by their numbers in the label map, values in the column's unit
 * and categories by name. A link is untrusted text: everything that this table does not have is ignored. Pure.
 */
import type { ObjectColumn } from "../bundle/generated/objects";
import { ALL_BYTES, type ObjectView, PALETTES, START_OBJECTS } from "../state/objects";
import { byteOf, byteValue } from "./palettes";
import type { ObjectTable } from "./table";

/** Widest gap between objects, um, that a link may ask for; the panel's slider is shorter. */
const WIDEST_UM = 1000;
/** Largest length of the text of one list of objects, in characters; a whole link may have 8000. */
const LONGEST = 2000;
const LISTS = ["hidden", "only", "selected"] as const;

type Known = Pick<ObjectTable, "count" | "column" | "first" | "label">;
type Span = readonly [number, number];
/** First and last of a run of consecutive numbers. */
type Run = readonly [bigint, bigint];

const same = (one: unknown, other: unknown) => JSON.stringify(one) === JSON.stringify(other);

/**
 * Returns the differences from the opening view as text; "": there are none. `leftOut` counts the objects of lists
 * that are too long for a link.
 */
export function writeLinked(
  view: ObjectView,
  table: Known,
): Readonly<{ text: string; leftOut: number }> {
  const { colorBy, span, ranges, without, picked } = view;
  const parts: Record<string, unknown> = {};
  for (const key of ["colorBy", "palette", "isLog", "isStained", "gap_um", "scatter"] as const) {
    if (!same(view[key], START_OBJECTS[key])) parts[key] = view[key];
  }
  const colored = table.column(colorBy ?? table.first);
  if (!same(span, ALL_BYTES) && colored?.range) parts.span = valuesOf(colored, span);
  const narrow = Object.entries(ranges).flatMap(([id, range]) => {
    const column = table.column(id);
    return column?.range && !same(range, ALL_BYTES) ? [[id, valuesOf(column, range)]] : [];
  });
  if (narrow.length > 0) parts.ranges = Object.fromEntries(narrow);
  const gone = Object.entries(without).flatMap(([id, list]) => {
    const names = table.column(id)?.categories;
    return names && list.length > 0 ? [[id, list.map((i) => names[i] ?? null)]] : [];
  });
  if (gone.length > 0) parts.without = Object.fromEntries(gone);
  let leftOut = 0;
  for (const key of LISTS) {
    const rows = view[key];
    if (rows === null || (rows.length === 0 && key !== "only")) continue;
    const text = runs(rows.map((row) => BigInt(table.label(row))));
    if (text.length <= LONGEST) parts[key] = text;
    else leftOut += rows.length;
  }
  if (picked !== null) parts.picked = table.label(picked);
  return { text: Object.keys(parts).length === 0 ? "" : JSON.stringify(parts), leftOut };
}

/** Returns the values of two bytes. Null stands for an open end, that is, for the first or the last byte. */
function valuesOf({ range }: ObjectColumn, bytes: Span): readonly (number | null)[] {
  return bytes.map((byte, i) =>
    byte === ALL_BYTES[i] || range === undefined
      ? null
      : Number(byteValue(range, byte).toPrecision(7)),
  );
}

/** Writes numbers as runs, such as `3-17.20`. */
function runs(numbers: bigint[]): string {
  const found: [bigint, bigint][] = [];
  for (const each of numbers.sort((one, other) => (one < other ? -1 : Number(one > other)))) {
    const newest = found.at(-1);
    if (newest !== undefined && each <= newest[1] + 1n) newest[1] = each;
    else found.push([each, each]);
  }
  return found.map(([low, high]) => (low === high ? low : `${low}-${high}`)).join(".");
}

function readRuns(text: unknown): readonly Run[] {
  if (typeof text !== "string") return [];
  return text.split(".").flatMap((part): Run[] => {
    const [, low, high = low] = /^(\d{1,20})(?:-(\d{1,20}))?$/.exec(part) ?? [];
    return low === undefined ? [] : [[BigInt(low), BigInt(high)]];
  });
}

/** Returns the change that applies a link's text to the view. Unreadable and unknown entries are ignored. */
export function readLinked(text: string, table: Known): Partial<ObjectView> {
  const change: { -readonly [K in keyof ObjectView]?: ObjectView[K] } = { linked: "" };
  let given: Record<string, unknown>;
  try {
    given = Object(JSON.parse(text));
  } catch {
    return change;
  }
  const rowsOf = (value: unknown) => {
    const wanted = readRuns(value);
    const rows: number[] = [];
    for (let row = 0; wanted.length > 0 && row < table.count; row++) {
      const label = BigInt(table.label(row));
      if (wanted.some(([low, high]) => low <= label && label <= high)) rows.push(row);
    }
    return rows;
  };
  const columnOf = (id: unknown) => (typeof id === "string" ? table.column(id) : null);
  const bytesOf = (column: ObjectColumn | null, value: unknown): Span | null => {
    const range = column?.range;
    if (range === undefined || !Array.isArray(value) || value.length !== 2) return null;
    const isEnd = (each: unknown) => each === null || Number.isFinite(each);
    if (!value.every(isEnd)) return null;
    const [low, high] = value.map((each, i) =>
      each === null ? ALL_BYTES[i] : byteOf(range, each),
    );
    return low <= high ? [low, high] : null;
  };
  const { colorBy, palette, span, isLog, ranges, without, only, picked, gap_um, scatter } = given;
  if (typeof given.isStained === "boolean") change.isStained = given.isStained;
  if (colorBy === "" || columnOf(colorBy) !== null) change.colorBy = colorBy as string;
  change.palette = PALETTES.find((each) => each === palette) ?? START_OBJECTS.palette;
  change.span = bytesOf(table.column(change.colorBy ?? table.first), span) ?? START_OBJECTS.span;
  if (typeof isLog === "boolean") change.isLog = isLog;
  change.ranges = Object.fromEntries(
    Object.entries(Object(ranges)).flatMap(([id, value]) => {
      const read = bytesOf(columnOf(id), value);
      return read === null ? [] : [[id, read]];
    }),
  );
  change.without = Object.fromEntries(
    Object.entries(Object(without)).flatMap(([id, list]) => {
      const names = columnOf(id)?.categories;
      if (names === undefined || !Array.isArray(list)) return [];
      const found = list.map((name) => (name === null ? -1 : names.indexOf(name)));
      const known = found.filter((index, i) => index >= 0 || list[i] === null);
      return known.length > 0 ? [[id, known]] : [];
    }),
  );
  change.hidden = rowsOf(given.hidden);
  change.only = typeof only !== "string" ? null : rowsOf(only);
  change.selected = rowsOf(given.selected);
  change.picked = rowsOf(picked)[0] ?? null;
  if (typeof gap_um === "number" && gap_um >= 0 && gap_um <= WIDEST_UM) change.gap_um = gap_um;
  if (Array.isArray(scatter) && scatter.length === 2 && scatter.every((id) => columnOf(id))) {
    change.scatter = [scatter[0], scatter[1]];
  }
  return change;
}
