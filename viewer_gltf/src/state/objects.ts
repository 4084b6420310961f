/**
 * How the objects of a label map are shown: their colours, and which are hidden or selected. The
 * table of objects is loaded by the code in objects/. Pure.
 */

export const PALETTES = ["viridis", "cividis", "magma", "diverging"] as const;
export type PaletteName = (typeof PALETTES)[number];

/**
 * Numbers of rows are rows of the table. A byte is a value of a column's file (see
 * schemas/objects.schema.json).
 */
export type ObjectView = Readonly<{
  /** ID of the column that colours the objects; "": none; null: the table's own choice. */
  colorBy: string | null;
  palette: PaletteName;
  /** Bytes (0..255) of the colouring column at which the palette begins and ends. */
  span: readonly [number, number];
  /**
   * Whether the palette is spread over the logarithm of the values; null: as in the
   * column's file.
   */
  isLog: boolean | null;
  /**
   * Lowest and highest byte that are shown, by column of numbers. Objects without a value are
   * hidden, too.
   */
  ranges: Readonly<Record<string, readonly [number, number]>>;
  /** Indices of categories that are hidden, by column; -1: objects without a category. */
  without: Readonly<Record<string, readonly number[]>>;
  hidden: readonly number[];
  /**
   * Row numbers of the objects to which the view is restricted; null: it is not restricted to some
   * objects.
   */
  only: readonly number[] | null;
  selected: readonly number[];
  /** Row of the object whose card is open. */
  picked: number | null;
  /** Object that the camera flies to; each request is a new JavaScript object. */
  aim: Readonly<{ row: number }> | null;
  /** Whether the stage's colours of the objects are shown, if it has any. */
  isStained: boolean;
  /** Gap between neighbouring objects, um on each side. */
  gap_um: number;
  search: string;
  /** Page of the legend of categories. */
  legend: number;
  /** Columns of the scatter plot; "": the first suitable ones. */
  scatter: readonly [string, string];
  /** Points of the lasso in the scatter plot, as shares of its width and height. */
  lasso: readonly (readonly [number, number])[];
  /** The text of these settings in a link, until the table is loaded. */
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

/** How each channel's objects are shown, by channel; one without an entry has START_OBJECTS. */
export type ObjectViews = Readonly<Record<string, ObjectView>>;

/** Changes how a channel's objects are shown; absent fields stay. */
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
