/** The controls for one column of a label map: its picture, the shown range, and the palette if it colours. */
import type { ObjectColumn } from "../bundle/generated/objects";
import type { Control, Picture } from "../panel/controls";
import { ALL_BYTES, type ObjectView, PALETTES, type PaletteName } from "../state/objects";
import type { ObjectControls } from "./object_controls";
import type { Objects } from "./objects";
import { byteValue, tableOf } from "./palettes";
import {
  byteAt,
  categoryAt,
  countBytes,
  drawCategories,
  drawHistogram,
  legendOf,
  NO_CATEGORY,
  numberText,
  placeOf,
  ROWS_OF_LEGEND,
  unitText,
} from "./pictures";

const PALETTE_NAMES: Readonly<Record<PaletteName, string>> = {
  viridis: "Viridis",
  cividis: "Cividis",
  magma: "Magma",
  diverging: "Blue–red",
};

/** Colours of the picture of a column that does not colour the objects: one light shade. */
const GREY = { palette: "cividis", span: [254, 255], isLog: false } as const;

const percent = (bytes: readonly [number, number]) =>
  [placeOf(bytes[0]), placeOf(bytes[1])] as const;

export class ColumnSection {
  constructor(
    private readonly objects: Objects,
    private readonly view: ObjectView,
    private readonly controls: ObjectControls,
  ) {}

  /**
   * Returns the controls of a column. Its picture also sets which objects are shown.
   *
   * @param colors whether this column colours the objects
   */
  items(column: ObjectColumn, colors: boolean): readonly Control[] {
    const bytes = this.objects.table.bytes(column.id);
    if (bytes === null) return [this.controls.text(`wait-${column.id}`, column.name, "loading …")];
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
      id: this.controls.id(`column-${column.id}`),
      label: `${column.name}: tap a category to hide its objects`,
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
        return this.controls.change({ without: { ...view.without, [column.id]: next } });
      },
    };
    if (pages === 1) return [picture];
    const turn = (part: string, label: string, to: number) =>
      this.controls.button(`${part}-${column.id}`, label, { legend: (to + pages) % pages });
    return [
      picture,
      this.controls.text(
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
    if (range === undefined)
      return [this.controls.text(`none-${id}`, name, "no object has a value")];
    const words = (byte: number) =>
      `${numberText(byteValue(range, byte))} ${unitText(unit)}`.trim();
    const set = (bytes: readonly [number, number]) =>
      this.controls.change({ ranges: { ...view.ranges, [id]: bytes } });
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
        id: this.controls.id(`${part}-${id}`),
        label,
        name: `${name}: ${label}`,
        value: percent(value),
        steps: 254,
        texts: [words(value[0]), words(value[1])],
        to: (ends: readonly [number, number]) => to([byteAt(ends[0]), byteAt(ends[1])]),
      }) as const;
    const picture: Picture = {
      kind: "picture",
      id: this.controls.id(`column-${id}`),
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
            window("span", "Colours", view.span, (span) => this.controls.change({ span })),
            this.palette(),
            ...(range.low > 0 ? [this.logarithm(range.scale === "log")] : []),
          ]
        : []),
    ];
  }

  private palette(): Control {
    return {
      kind: "choice",
      id: this.controls.id("palette"),
      label: "Palette",
      value: this.view.palette,
      options: PALETTES.map((value) => ({ value, label: PALETTE_NAMES[value] })),
      isInline: false,
      to: (palette) => this.controls.change({ palette: palette as PaletteName }),
    };
  }

  private logarithm(isUsual: boolean): Control {
    return {
      kind: "toggle",
      id: this.controls.id("log"),
      label: "Logarithmic colours",
      value: this.view.isLog ?? isUsual,
      to: (isLog) => this.controls.change({ isLog }),
    };
  }
}
