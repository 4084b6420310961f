/** What a link says of a label map's objects, as far as this table has it: a link is somebody else's text. Pure. */
import { type ObjectView, PALETTES, START_OBJECTS } from "../state/objects";
import type { ObjectTable } from "./table";

/** Widest gap, um, that a link may ask for; the panel's slider is shorter. */
const WIDEST_UM = 1000;

type Known = Pick<ObjectTable, "count" | "column">;

const isByte = (value: unknown) =>
  Number.isInteger(value) && 0 <= Number(value) && Number(value) <= 255;

/** The change that brings the view to a link's; what can't be read is left out. */
export function readLinked(text: string, table: Known): Partial<ObjectView> {
  const change: { -readonly [K in keyof ObjectView]?: ObjectView[K] } = { linked: "" };
  let given: Record<string, unknown>;
  try {
    given = Object(JSON.parse(text));
  } catch {
    return change;
  }
  const rowsOf = (value: unknown) =>
    Array.isArray(value)
      ? value.filter((row) => Number.isInteger(row) && row >= 0 && row < table.count)
      : [];
  const isColumn = (id: unknown) => typeof id === "string" && table.column(id) !== null;
  const spanOf = (value: unknown): readonly [number, number] | null =>
    Array.isArray(value) && value.length === 2 && value.every(isByte) && value[0] <= value[1]
      ? [value[0], value[1]]
      : null;
  const { colorBy, palette, span, isLog, ranges, without, only, picked, gap_um, scatter } = given;
  if (typeof given.isStained === "boolean") change.isStained = given.isStained;
  if (colorBy === "" || isColumn(colorBy)) change.colorBy = colorBy as string;
  change.palette = PALETTES.find((each) => each === palette) ?? START_OBJECTS.palette;
  change.span = spanOf(span) ?? START_OBJECTS.span;
  if (typeof isLog === "boolean") change.isLog = isLog;
  change.ranges = Object.fromEntries(
    Object.entries(Object(ranges)).flatMap(([id, value]) => {
      const read = isColumn(id) ? spanOf(value) : null;
      return read === null ? [] : [[id, read]];
    }),
  );
  change.without = Object.fromEntries(
    Object.entries(Object(without)).filter(
      ([id, list]) => isColumn(id) && Array.isArray(list) && list.every((i) => isByte(i + 1)),
    ) as [string, number[]][],
  );
  change.hidden = rowsOf(given.hidden);
  change.only = only == null ? null : rowsOf(only);
  change.selected = rowsOf(given.selected);
  change.picked = rowsOf([picked])[0] ?? null;
  if (typeof gap_um === "number" && gap_um >= 0 && gap_um <= WIDEST_UM) change.gap_um = gap_um;
  if (Array.isArray(scatter) && scatter.length === 2 && scatter.every(isColumn)) {
    change.scatter = [scatter[0], scatter[1]];
  }
  return change;
}
