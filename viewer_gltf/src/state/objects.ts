/**
 * How the objects of a label map are shown: what colours them, which are left out, which are meant. The table
 * itself is not here: it comes with the code that reads it (objects/). Pure.
 */

export const PALETTES = ["viridis", "cividis", "magma", "diverging"] as const;
export type PaletteName = (typeof PALETTES)[number];

/** Numbers of rows are rows of the table; a byte is one of a column's file: see schemas/objects.schema.json. */
export type ObjectView = Readonly<{
  /** ID of a column; "": none; null: the table's own choice. */
  colorBy: string | null;
  palette: PaletteName;
  /** The bytes at which the palette begins and ends. */
  span: readonly [number, number];
  /** Evenly in the logarithm; null: as the column's bytes lie. */
  isLog: boolean | null;
  /** By column, the bytes that are left: numbers' lowest and highest. What is missing goes, too. */
  ranges: Readonly<Record<string, readonly [number, number]>>;
  /** By column, the categories that are left out, by index; -1: those without. */
  without: Readonly<Record<string, readonly number[]>>;
  hidden: readonly number[];
  /** The only ones that are shown; null: all are. */
  only: readonly number[] | null;
  selected: readonly number[];
  /** Whose card is open. */
  picked: number | null;
  /** To be flown to; anew with each new object. */
  aim: Readonly<{ row: number }> | null;
  /** Whether what is painted on them shows, where there is something. */
  isStained: boolean;
  /** Space that each leaves along its walls, um. */
  gap_um: number;
  search: string;
  /** Page of the categories' legend. */
  legend: number;
  /** Columns of the scatter plot; "": the first that suit. */
  scatter: readonly [string, string];
  /** In the scatter plot, shares of its width and height. */
  lasso: readonly (readonly [number, number])[];
  /** As a link has it, until the table has come. */
  linked: string;
}>;

export const ALL_BYTES = [1, 255] as const;

export const START_OBJECTS: ObjectView = {
  colorBy: null,
  palette: "viridis",
  span: ALL_BYTES,
  isLog: null,
  ranges: {},
  without: {},
  hidden: [],
  only: null,
  selected: [],
  picked: null,
  aim: null,
  isStained: true,
  gap_um: 0,
  search: "",
  legend: 0,
  scatter: ["", ""],
  lasso: [],
  linked: "",
};

/** By channel; absent: as at the start. */
export type ObjectViews = Readonly<Record<string, ObjectView>>;

/** Some of it is another from now on. */
export type ObjectChange = Readonly<{
  type: "objects";
  channel: string;
  change: Partial<ObjectView>;
}>;

export function withObjects(views: ObjectViews, { channel, change }: ObjectChange): ObjectViews {
  const before = views[channel] ?? START_OBJECTS;
  const isSame = Object.entries(change).every(
    ([key, value]) => before[key as keyof ObjectView] === value,
  );
  return isSame ? views : { ...views, [channel]: { ...before, ...change } };
}
