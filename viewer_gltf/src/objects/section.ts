/**
 * The panel's section of a label map's objects: what colours them, which show, the card of one, two columns
 * against each other. It comes with the code of objects/. Pure but for what its pictures draw.
 */
import type { ObjectColumn } from "../bundle/generated/objects";
import type { Control, Picture, Wish } from "../panel/controls";
import {
  ALL_BYTES,
  type ObjectView,
  PALETTES,
  type PaletteName,
  START_OBJECTS,
} from "../state/objects";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import { filtered } from "./flags";
import type { Objects } from "./objects";
import { byteValue, tableOf } from "./palettes";
import {
  byteAt,
  categoryAt,
  countBytes,
  drawCategories,
  drawHistogram,
  drawScatter,
  inLasso,
  legendOf,
  NO_CATEGORY,
  numberText,
  placeOf,
  ROWS_OF_LEGEND,
  unitText,
} from "./pictures";
import type { ObjectTable } from "./table";

const PALETTE_NAMES: Readonly<Record<PaletteName, string>> = {
  viridis: "Viridis",
  cividis: "Cividis",
  magma: "Magma",
  diverging: "Blue–red",
};
/** Most results of a search that have a row. */
const MAX_FOUND = 6;
/** Least way of a lasso from one corner to the next, shares of the plot. */
const LASSO_STEP = 0.012;
/** The gap's slider: so much of a cell of this kind of table. */
const GAP_STEPS = 40;

const percent = (bytes: readonly [number, number]) =>
  [placeOf(bytes[0]), placeOf(bytes[1])] as const;

export function objectItems(
  objects: Objects,
  state: ViewerState,
  channel: string,
  isLast: boolean,
): readonly Control[] {
  const items = new Layout(objects, state.objects[channel] ?? START_OBJECTS, channel).items();
  return isLast ? [...items, SAVE] : items;
}

/** Once for all label maps. */
const SAVE: Control = {
  kind: "button",
  id: "save-objects",
  label: "Save as CSV (selected, or all shown)",
  to: () => "save-objects",
};

class Layout {
  private readonly table;

  constructor(
    private readonly objects: Objects,
    private readonly view: ObjectView,
    private readonly channel: string,
  ) {
    this.table = objects.table;
  }

  items(): readonly Control[] {
    const { table, objects, view } = this;
    const by = table.column(objects.colorBy);
    const others = Object.keys({ ...view.ranges, ...view.without }).filter((id) => id !== by?.id);
    return [
      this.text("count", "Shown", `${objects.left} of ${table.count} objects`),
      this.columnChoice(
        "color-by",
        "Colour by",
        objects.colorBy,
        table.columns,
        "As in the stage",
        (id) => ({
          colorBy: id,
          span: ALL_BYTES,
          isLog: null,
        }),
      ),
      ...(by === null ? [] : this.columnItems(by, true)),
      ...this.stain(),
      ...others.flatMap((id) => {
        const column = table.column(id);
        return column === null ? [] : this.columnItems(column, false);
      }),
      this.columnChoice(
        "filter-by",
        "Filter by",
        "",
        table.columns.filter(({ id }) => id !== by?.id && !others.includes(id)),
        "another column …",
        (id) => {
          const kind = table.column(id)?.kind;
          if (kind === undefined) return {};
          return kind === "category"
            ? { without: { ...view.without, [id]: [] } }
            : { ranges: { ...view.ranges, [id]: ALL_BYTES } };
        },
      ),
      ...this.searchItems(),
      ...this.card(),
      ...this.choiceOfMany(),
      this.gap(),
      ...this.scatter(),
    ];
  }

  private id(part: string): string {
    return `${this.channel}/objects-${part}`;
  }

  private change(change: Partial<ObjectView>): Wish {
    return { type: "objects", channel: this.channel, change };
  }

  private text(part: string, label: string, value: string): Control {
    return { kind: "text", id: this.id(part), label, value };
  }

  private button(part: string, label: string, change: Partial<ObjectView>, refusal = ""): Control {
    return { kind: "button", id: this.id(part), label, refusal, to: () => this.change(change) };
  }

  private columnChoice(
    part: string,
    label: string,
    value: string,
    columns: readonly ObjectColumn[],
    none: string,
    change: (id: string) => Partial<ObjectView>,
  ): Control {
    const listed = columns.map(({ id, name }) => ({ value: id, label: name }));
    return {
      kind: "choice",
      id: this.id(part),
      label,
      value,
      options: [{ value: "", label: none }, ...listed],
      isInline: false,
      to: (id) => this.change(change(id)),
    };
  }

  /** A column's picture, in which what shows is chosen. @param colors whether it is the one that colours */
  private columnItems(column: ObjectColumn, colors: boolean): readonly Control[] {
    const bytes = this.table.bytes(column.id);
    if (bytes === null) return [this.text(`wait-${column.id}`, column.name, "loading …")];
    const [all, left] = countBytes(bytes, this.objects.flags);
    const table = tableOf(column, colors ? this.view : { ...this.view, ...GREY });
    const state = [
      this.view.palette,
      this.view.span,
      this.view.isLog,
      this.objects.version,
      colors,
    ];
    return column.kind === "category"
      ? this.categories(column, [all, left], table, state.join())
      : this.numbers(column, [all, left], table, state.join(), colors);
  }

  private categories(
    column: ObjectColumn,
    counts: readonly [Uint32Array, Uint32Array],
    table: Uint8Array,
    version: string,
  ): readonly Control[] {
    const { view } = this;
    const without = view.without[column.id] ?? [];
    const { indices, page, pages, count } = legendOf(column, counts[0][0] > 0, view.legend);
    const nameOf = (index: number) => column.categories?.[index] ?? NO_CATEGORY;
    const first = page * ROWS_OF_LEGEND;
    const picture: Picture = {
      kind: "picture",
      id: this.id(`column-${column.id}`),
      label: `${column.name}: tap one to leave it out`,
      about: column.about,
      height: 0.12 * indices.length,
      version: `${version} ${without} ${page}`,
      text: indices
        .map((index) => {
          const out = without.includes(index) ? ", left out" : "";
          return `${nameOf(index)} ${counts[1][index + 1]}${out}`;
        })
        .join("; "),
      draw: (context, width, height) => {
        const rows = indices.map((index) => ({ index, name: nameOf(index) }));
        drawCategories(context, width, height, rows, counts, table, without);
      },
      press: (_, down) => {
        const index = categoryAt(indices, down);
        const next = without.includes(index)
          ? without.filter((each) => each !== index)
          : [...without, index];
        return this.change({ without: { ...view.without, [column.id]: next } });
      },
    };
    if (pages === 1) return [picture];
    const turn = (part: string, label: string, to: number) =>
      this.button(`${part}-${column.id}`, label, { legend: (to + pages) % pages });
    return [
      picture,
      this.text(
        `legend-${column.id}`,
        "Categories",
        `${first + 1} to ${first + indices.length} of ${count}`,
      ),
      turn("legend-next", "Next categories", page + 1),
      turn("legend-back", "Previous categories", page - 1),
    ];
  }

  private numbers(
    column: ObjectColumn,
    counts: readonly [Uint32Array, Uint32Array],
    table: Uint8Array,
    version: string,
    colors: boolean,
  ): readonly Control[] {
    const { view } = this;
    const { id, name, range, unit } = column;
    const brush = view.ranges[id] ?? ALL_BYTES;
    if (range === undefined) return [this.text(`none-${id}`, name, "no object has a value")];
    const words = (byte: number) =>
      `${numberText(byteValue(range, byte))} ${unitText(unit)}`.trim();
    const set = (bytes: readonly [number, number]) =>
      this.change({ ranges: { ...view.ranges, [id]: bytes } });
    const moved = (across: number) => {
      const byte = byteAt(across);
      const isLow = byte < brush[0] || (byte <= brush[1] && byte - brush[0] < brush[1] - byte);
      return set(isLow ? [byte, brush[1]] : [brush[0], byte]);
    };
    const window = (
      part: string,
      label: string,
      value: readonly [number, number],
      to: typeof set,
    ) =>
      ({
        kind: "window",
        id: this.id(`${part}-${id}`),
        label,
        name: `${name}: ${label}`,
        value: percent(value),
        steps: 254,
        texts: [words(value[0]), words(value[1])],
        to: (ends: readonly [number, number]) => to([byteAt(ends[0]), byteAt(ends[1])]),
      }) as const;
    const picture: Picture = {
      kind: "picture",
      id: this.id(`column-${id}`),
      label: name,
      about: column.about,
      height: 0.28,
      version: `${version} ${brush}`,
      text: `${words(brush[0])} to ${words(brush[1])} shown`,
      draw: (context, width, height) =>
        drawHistogram(context, width, height, column, counts, table, brush),
      press: moved,
      drag: moved,
    };
    return [
      picture,
      window("range", "Shown", brush, set),
      ...(colors
        ? [
            window("span", "Colours", view.span, (span) => this.change({ span })),
            this.palette(),
            ...(range.low > 0 ? [this.logarithm(range.scale === "log")] : []),
          ]
        : []),
    ];
  }

  private palette(): Control {
    return {
      kind: "choice",
      id: this.id("palette"),
      label: "Palette",
      value: this.view.palette,
      options: PALETTES.map((value) => ({ value, label: PALETTE_NAMES[value] })),
      isInline: false,
      to: (palette) => this.change({ palette: palette as PaletteName }),
    };
  }

  private logarithm(isUsual: boolean): Control {
    return {
      kind: "toggle",
      id: this.id("log"),
      label: "Colours by the logarithm",
      value: this.view.isLog ?? isUsual,
      to: (isLog) => this.change({ isLog }),
    };
  }

  private stain(): readonly Control[] {
    const { stainName } = this.objects;
    if (stainName === "") return [];
    return [
      {
        kind: "toggle",
        id: this.id("stain"),
        label: `${stainName} painted on the objects`,
        value: this.view.isStained,
        to: (isStained) => this.change({ isStained }),
      },
    ];
  }

  private searchItems(): readonly Control[] {
    const { table, view } = this;
    const found = table.find(view.search, MAX_FOUND);
    return [
      {
        kind: "search",
        id: this.id("search"),
        label: "Find by name or number",
        value: view.search,
        hints: table.names.slice(0, 24),
        to: (search) => this.change({ search }),
      },
      ...found.map((row) =>
        this.button(`found-${row}`, `Go to ${table.title(row)}`, { picked: row, aim: { row } }),
      ),
      ...(view.search.trim() !== "" && found.length === 0
        ? [this.text("found-none", "Found", "no object")]
        : []),
    ];
  }

  /** What can be done with the object that was picked, and all that is known of it: there may be many columns. */
  private card(): readonly Control[] {
    const { table, view } = this;
    const row = view.picked;
    if (row === null || row >= table.count) {
      return [this.text("card", "Object", "Tap an object, or look at it, to open its card.")];
    }
    const title = table.title(row);
    const label = table.label(row);
    const others = [...table.neighbours(row)];
    const wall = largestWall(table, row);
    return [
      this.text("card", "Object", title === label ? title : `${title} (${label})`),
      this.button("fly", "Go there", { aim: { row } }),
      this.button("only", "Only this object", { only: [row] }),
      ...(table.hasNeighbours
        ? [this.button("only-next", "Only it and its neighbours", { only: [row, ...others] })]
        : []),
      this.button(
        "select",
        view.selected.includes(row) ? "Take out of the selection" : "Add to the selection",
        {
          selected: view.selected.includes(row)
            ? view.selected.filter((each) => each !== row)
            : [...view.selected, row],
        },
      ),
      this.button("hide", "Hide this object", { hidden: [...view.hidden, row], picked: null }),
      this.button("close", "Close the card", { picked: null }),
      ...table.columns.map((column) =>
        this.text(`card-${column.id}`, column.name, this.valueText(column, row)),
      ),
      ...(table.hasNeighbours ? [this.text("card-next", "Neighbours", String(others.length))] : []),
      ...(wall === "" ? [] : [this.text("card-wall", "Largest interface, with", wall)]),
    ];
  }

  private valueText(column: ObjectColumn, row: number): string {
    const value = this.table.value(column.id, row);
    if (value === null) return "…";
    if (column.kind === "category") return column.categories?.[value] ?? "none";
    const text = numberText(value);
    return text === "" ? "none" : `${text} ${unitText(column.unit)}`.trim();
  }

  /** What is done with the selected ones, or with all that show. */
  private choiceOfMany(): readonly Control[] {
    const { view, objects } = this;
    const { selected } = view;
    const none = selected.length === 0 ? REFUSED.objects : "";
    const isWhole = view.hidden.length === 0 && view.only === null && filtered(view).length === 0;
    return [
      this.text(
        "selected",
        "Selected",
        selected.length === 0 ? "none" : `${selected.length} objects`,
      ),
      this.button("select-shown", "Select all that show", { selected: objects.shown }),
      this.button(
        "hide-selected",
        "Hide the selected",
        { hidden: [...view.hidden, ...selected], selected: [], lasso: [] },
        none,
      ),
      this.button("only-selected", "Only the selected", { only: selected }, none),
      this.button("unselect", "Select none", { selected: [], lasso: [] }, none),
      this.button(
        "all",
        "Show all",
        { hidden: [], only: null, ranges: {}, without: {} },
        isWhole ? "All objects are shown." : "",
      ),
    ];
  }

  private gap(): Control {
    const most_um = this.objects.widestGap_um;
    const { gap_um } = this.view;
    return {
      kind: "slider",
      id: this.id("gap"),
      label: "Gap between objects",
      value: Math.min(1, gap_um / most_um),
      steps: GAP_STEPS,
      text: `${numberText(gap_um)} µm`,
      to: (share) => this.change({ gap_um: Number((share * most_um).toPrecision(3)) }),
    };
  }

  private scatter(): readonly Control[] {
    const { table, view, objects } = this;
    const numbers = table.columns.filter(({ kind, range }) => kind === "number" && range);
    if (numbers.length < 2) return [];
    const axes = view.scatter.map(
      (id, i) => numbers.find((column) => column.id === id) ?? numbers[i],
    );
    const choices = (["Across", "Up"] as const).map((label, i) => ({
      ...this.columnChoice(`scatter-${i}`, label, axes[i].id, numbers, "", (id) => ({
        scatter: (i === 0 ? [id, axes[1].id] : [axes[0].id, id]) as [string, string],
        lasso: [],
      })),
    }));
    const [xs, ys] = axes.map(({ id }) => table.bytes(id));
    const by = table.column(objects.colorBy);
    const bytes = by && table.bytes(by.id);
    const colors = by && tableOf(by, view);
    const colorOf = (row: number) => {
      const at = 4 * (bytes?.[row] ?? 0);
      return colors && bytes ? `rgb(${colors[at]} ${colors[at + 1]} ${colors[at + 2]})` : "#8fa3c0";
    };
    if (xs === null || ys === null)
      return [...choices, this.text("wait-scatter", "Plot", "loading …")];
    const lassoed = (lasso: ObjectView["lasso"]) =>
      this.change({ lasso, selected: inLasso(lasso, objects.flags, [xs, ys]) });
    const name = (column: ObjectColumn) => `${column.name} ${unitText(column.unit)}`.trim();
    return [
      ...choices,
      {
        kind: "picture",
        id: this.id("scatter"),
        label: `Draw around points to select them: ${name(axes[0])} across, ${name(axes[1])} up`,
        height: 0.75,
        version: [
          objects.version,
          objects.colorBy,
          view.palette,
          view.span,
          view.isLog,
          view.scatter,
          view.lasso,
        ].join(),
        text: `${view.selected.length} objects selected`,
        draw: (context, width, height) =>
          drawScatter(context, width, height, table, view, objects.flags, [xs, ys], colorOf),
        press: (x, y) => this.change({ lasso: [[x, y]], selected: [] }),
        drag: (x, y) => {
          const [px, py] = view.lasso.at(-1) ?? [x, y];
          return Math.hypot(x - px, y - py) < LASSO_STEP ? null : lassoed([...view.lasso, [x, y]]);
        },
      },
    ];
  }
}

/** The neighbour that a row shares the most with, `liver, 120 µm²`; "": none, or not known. */
export function largestWall(
  table: Pick<ObjectTable, "neighbours" | "walls_um2" | "title">,
  row: number,
): string {
  const areas = [...(table.walls_um2(row) ?? [])];
  const largest = Math.max(...areas);
  if (!Number.isFinite(largest)) return "";
  const other = table.neighbours(row)[areas.indexOf(largest)];
  return `${table.title(other)}, ${numberText(largest)} ${unitText("um2")}`;
}

/** View of a column that does not colour: grey. */
const GREY = { palette: "cividis", span: [254, 255], isLog: false } as const;
