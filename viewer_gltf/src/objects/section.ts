/**
 * The panel's section for the objects of a label map: the column that colours them, the filters, the card of the
 * picked object, and a scatter plot of two columns. This file is loaded together with the code of objects/.
 * Pure, except for the canvases that its pictures draw on.
 */
import type { ObjectColumn } from "../bundle/generated/objects";
import type { Control } from "../panel/controls";
import { ALL_BYTES, type ObjectView, START_OBJECTS } from "../state/objects";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import { ColumnSection } from "./column_section";
import { filtered } from "./flags";
import { ObjectControls } from "./object_controls";
import type { Objects } from "./objects";
import { tableOf } from "./palettes";
import { drawScatter, inLasso, numberText, unitText } from "./pictures";
import type { ObjectTable } from "./table";

/** Largest number of search results that the panel lists. */
const MAX_FOUND = 6;
/** Smallest distance between two corners of a lasso, as a share of the plot's edge. */
const LASSO_STEP = 0.012;
/** Number of steps of the slider for the gap. */
const GAP_STEPS = 40;

export function objectItems(
  objects: Objects,
  state: ViewerState,
  channel: string,
  isLast: boolean,
): readonly Control[] {
  const items = new ObjectSection(
    objects,
    state.objects[channel] ?? START_OBJECTS,
    channel,
  ).items();
  return isLast ? [...items, SAVE] : items;
}

/** One button saves the objects of all label maps, so only the last section has it. */
const SAVE: Control = {
  kind: "button",
  id: "save-objects",
  label: "Save as CSV (selected objects, or all shown)",
  to: () => "save-objects",
};

class ObjectSection {
  private readonly table;
  private readonly controls;
  private readonly columns;

  constructor(
    private readonly objects: Objects,
    private readonly view: ObjectView,
    channel: string,
  ) {
    this.table = objects.table;
    this.controls = new ObjectControls(channel);
    this.columns = new ColumnSection(objects, view, this.controls);
  }

  items(): readonly Control[] {
    const { table, objects, view } = this;
    const by = table.column(objects.colorBy);
    const others = Object.keys({ ...view.ranges, ...view.without }).filter((id) => id !== by?.id);
    return [
      this.controls.text("count", "Shown", `${objects.shownCount} of ${table.count} objects`),
      this.controls.columnChoice(
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
      ...(by === null ? [] : this.columns.items(by, true)),
      ...this.stain(),
      ...others.flatMap((id) => {
        const column = table.column(id);
        return column === null ? [] : this.columns.items(column, false);
      }),
      this.controls.columnChoice(
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

  private stain(): readonly Control[] {
    const { stainName } = this.objects;
    if (stainName === "") return [];
    return [
      {
        kind: "toggle",
        id: this.controls.id("stain"),
        label: `${stainName} painted on the objects`,
        value: this.view.isStained,
        to: (isStained) => this.controls.change({ isStained }),
      },
    ];
  }

  private searchItems(): readonly Control[] {
    const { table, view } = this;
    const found = table.find(view.search, MAX_FOUND);
    return [
      {
        kind: "search",
        id: this.controls.id("search"),
        label: "Find by name or number",
        value: view.search,
        hints: table.names.slice(0, 24),
        to: (search) => this.controls.change({ search }),
      },
      ...found.map((row) =>
        this.controls.button(`found-${row}`, `Go to ${table.title(row)}`, {
          picked: row,
          aim: { row },
        }),
      ),
      ...(view.search.trim() !== "" && found.length === 0
        ? [this.controls.text("found-none", "Found", "no object")]
        : []),
    ];
  }

  /** The card of the picked object: its buttons first, because the list of its values may be long. */
  private card(): readonly Control[] {
    const { table, view } = this;
    const row = view.picked;
    if (row === null || row >= table.count) {
      return [
        this.controls.text("card", "Object", "Tap an object or look at it to open its card."),
      ];
    }
    const title = table.title(row);
    const label = table.label(row);
    const others = [...table.neighbours(row)];
    const largest = largestInterface(table, row);
    return [
      this.controls.text("card", "Object", title === label ? title : `${title} (${label})`),
      this.controls.button("fly", "Go to this object", { aim: { row } }),
      this.controls.button("only", "Show only this object", { only: [row] }),
      ...(table.hasNeighbours
        ? [
            this.controls.button("only-next", "Show only this object and its neighbours", {
              only: [row, ...others],
            }),
          ]
        : []),
      this.controls.button(
        "select",
        view.selected.includes(row) ? "Remove from the selection" : "Add to the selection",
        {
          selected: view.selected.includes(row)
            ? view.selected.filter((each) => each !== row)
            : [...view.selected, row],
        },
      ),
      this.controls.button("hide", "Hide this object", {
        hidden: [...view.hidden, row],
        picked: null,
      }),
      this.controls.button("close", "Close the card", { picked: null }),
      ...table.columns.map((column) =>
        this.controls.text(`card-${column.id}`, column.name, valueText(table, column, row)),
      ),
      ...(table.hasNeighbours
        ? [this.controls.text("card-next", "Neighbours", String(others.length))]
        : []),
      ...(largest === ""
        ? []
        : [this.controls.text("card-wall", "Neighbour with the largest interface", largest)]),
    ];
  }

  /** Buttons that select, hide or show many objects at once. */
  private choiceOfMany(): readonly Control[] {
    const { view, objects } = this;
    const { selected } = view;
    const none = selected.length === 0 ? REFUSED.objects : "";
    const isWhole = view.hidden.length === 0 && view.only === null && filtered(view).length === 0;
    return [
      this.controls.text(
        "selected",
        "Selected",
        selected.length === 0 ? "none" : `${selected.length} objects`,
      ),
      this.controls.button("select-shown", "Select all shown objects", { selected: objects.shown }),
      this.controls.button(
        "hide-selected",
        "Hide the selected objects",
        { hidden: [...view.hidden, ...selected], selected: [], lasso: [] },
        none,
      ),
      this.controls.button(
        "only-selected",
        "Show only the selected objects",
        { only: selected },
        none,
      ),
      this.controls.button("unselect", "Clear the selection", { selected: [], lasso: [] }, none),
      this.controls.button(
        "all",
        "Show all objects",
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
      id: this.controls.id("gap"),
      label: "Gap between objects",
      value: Math.min(1, gap_um / most_um),
      steps: GAP_STEPS,
      text: `${numberText(gap_um)} µm`,
      to: (share) => this.controls.change({ gap_um: Number((share * most_um).toPrecision(3)) }),
    };
  }

  private scatter(): readonly Control[] {
    const { table, view, objects } = this;
    const numbers = table.columns.filter(({ kind, range }) => kind === "number" && range);
    if (numbers.length < 2) return [];
    const axes = view.scatter.map(
      (id, i) => numbers.find((column) => column.id === id) ?? numbers[i],
    );
    const choices = (["Horizontal axis", "Vertical axis"] as const).map((label, i) => ({
      ...this.controls.columnChoice(`scatter-${i}`, label, axes[i].id, numbers, "", (id) => ({
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
      return [...choices, this.controls.text("wait-scatter", "Plot", "loading …")];
    const lassoed = (lasso: ObjectView["lasso"]) =>
      this.controls.change({ lasso, selected: inLasso(lasso, objects.flags, [xs, ys]) });
    const name = (column: ObjectColumn) => `${column.name} ${unitText(column.unit)}`.trim();
    return [
      ...choices,
      {
        kind: "picture",
        id: this.controls.id("scatter"),
        label: `${name(axes[1])} over ${name(axes[0])}: draw around points to select their objects`,
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
        press: (x, y) => this.controls.change({ lasso: [[x, y]], selected: [] }),
        drag: (x, y) => {
          const [px, py] = view.lasso.at(-1) ?? [x, y];
          return Math.hypot(x - px, y - py) < LASSO_STEP ? null : lassoed([...view.lasso, [x, y]]);
        },
      },
    ];
  }
}

function valueText(table: ObjectTable, column: ObjectColumn, row: number): string {
  const value = table.value(column.id, row);
  if (value === null) return "…";
  if (column.kind === "category") return column.categories?.[value] ?? "none";
  const text = numberText(value);
  return text === "" ? "none" : `${text} ${unitText(column.unit)}`.trim();
}

/**
 * Returns the neighbour with the largest interface to an object, and its area, such as `liver, 120 µm²`.
 * The text is empty if the object has no neighbour or the areas are not known.
 */
export function largestInterface(
  table: Pick<ObjectTable, "neighbours" | "interfaces_um2" | "title">,
  row: number,
): string {
  const areas = [...(table.interfaces_um2(row) ?? [])];
  const largest = Math.max(...areas);
  if (!Number.isFinite(largest)) return "";
  const other = table.neighbours(row)[areas.indexOf(largest)];
  return `${table.title(other)}, ${numberText(largest)} ${unitText("um2")}`;
}
