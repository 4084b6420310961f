/**
 * Draws the controls of a layout as rows of the panel on a canvas, each tall enough to be hit by a
 * gaze. Pure.
 */
import type { Button, Choice, Colour, Control, Group, Search, Toggle } from "../controls";
import {
  chips,
  mapBlock,
  nextSwatch,
  optionRows,
  palettes,
  stepper,
  swatches,
  swatchMarks,
} from "./choices";
import {
  type Block,
  box,
  type CanvasChange,
  GAP,
  inset,
  type Mark,
  type Rect,
  ROW,
  SMALL,
  split,
  text,
} from "./draw_list";
import { LABEL, one, region, toneOf, unlessRefused } from "./parts";
import { pictureBlock } from "./picture";
import { sliderRow, windowRow } from "./sliders";
import { histogramBlock } from "./transfer_function_2d";

/**
 * Controls that are of no use in stereo. They enter stereo (*Leave* ends it), read the QR code of a
 * Cardboard viewer, which needs the phone out of the viewer, or measure the screen with a bank
 * card. They choose or save files, list the keys of a keyboard, or show slice images beside the
 * specimen.
 */
const NOT_IN_STEREO: ReadonlySet<string> = new Set([
  ...["stereo", "split"],
  ...["scan", "lens-code", "measure-screen"],
  ...["own-light", "save-csv", "save-objects"],
  "slice-pictures", // a headset shows the slice planes in the specimen instead
  // images and views of the screen's camera, as files
  ...["picture-size", "save-picture", "save-video", "keep-view", "next-view", "forget-views"],
  "help",
]);
/** Width of a swatch in a channel's row, px: 6 degrees at 1.2 m. */
const SWATCH = 110;
/**
 * Largest number of letters that fit between two arrows. Up to MAX_LISTED options with longer names
 * get a row each.
 */
const LONG = 16;
const MAX_LISTED = 6;

/** @param fanned the group whose colours are drawn over its name; null: none */
export function blocksOf(
  item: Control | Group,
  width: number,
  fanned: string | null = null,
): readonly Block[] {
  if (item.kind === "group") return [groupRow(item, width, item.id === fanned)];
  if (NOT_IN_STEREO.has(item.id)) return [];
  const row: Rect = { x: 0, y: 0, width, height: ROW };
  switch (item.kind) {
    case "toggle":
      return [toggleRow(item, row)];
    case "button":
      return [buttonIn(item, row)];
    case "slider":
      return [sliderRow(item, row)];
    case "window":
      return [windowRow(item, 0, row), windowRow(item, 1, row)];
    case "choice":
      if (item.isInline) return [chips(item, width)];
      return isWordy(item) ? optionRows(item, width) : [stepper(item, row)];
    case "colour":
      return item.palettes.length === 0 ? [nextSwatch(item, row)] : palettes(item, width);
    case "map":
      return [mapBlock(item, width)];
    case "histogram":
      return [histogramBlock(item, width)];
    case "picture":
      return [pictureBlock(item, width)];
    case "text":
      return item.value === "" ? [] : [textBlock(item.label, item.value, width)];
    case "search":
      return item.hints === undefined ? [] : [stepper(asChoice(item, item.hints), row)];
    case "link":
      return [
        textBlock(item.label, "The link is the address of this page: copy it from there.", width),
      ];
  }
}

/** Returns whether the options are few, and too long for the space between two arrows. */
function isWordy({ options }: Choice): boolean {
  return options.length <= MAX_LISTED && options.some(({ label }) => label.length > LONG);
}

/** Returns a search as a choice of its hints, because nobody can type by gaze. */
function asChoice({ id, value, to }: Search, hints: readonly string[]): Choice {
  const options = ["", ...hints].map((hint) => ({ value: hint, label: hint || "all" }));
  return { kind: "choice", id, label: "Begins with", value, options, isInline: false, to };
}

/** Returns the blocks of a section. A button that repeats while it is held shares a row with its opposite. */
export function blocksOfAll(
  items: readonly (Control | Group)[],
  width: number,
  fanned: string | null = null,
): readonly Block[] {
  const blocks: Block[] = [];
  for (let i = 0; i < items.length; i++) {
    const [item, next] = [items[i], items[i + 1]];
    if (isRepeating(item) && next !== undefined && isRepeating(next)) {
      const rects = split({ x: 0, y: 0, width, height: ROW }, 2);
      const [left, right] = [buttonIn(item, rects[0]), buttonIn(next, rects[1])];
      blocks.push(one([...left.marks, ...right.marks], [...left.regions, ...right.regions]));
      i++;
    } else blocks.push(...blocksOf(item, width, fanned));
  }
  return blocks;
}

function isRepeating(item: Control | Group): item is Button {
  return item.kind === "button" && item.repeats !== undefined;
}

function buttonIn(item: Button, rect: Rect): Block {
  const { repeats, isStep } = item;
  const place = { ...region(item.id, item.name ?? item.label, rect, item.to), isStep };
  return one(
    [
      box(rect, item.isPrimary && !item.refusal ? "accent" : "raised"),
      text(rect, item.label, { align: "center", tone: toneOf(item, item.isPrimary) }),
    ],
    unlessRefused(item, [repeats === undefined ? place : { ...place, repeats }]),
  );
}

function toggleRow(toggle: Toggle, row: Rect, isDimmed = false): Block {
  const mark: Rect = { ...row, width: ROW };
  const label: Rect = { ...row, x: row.x + ROW, width: row.width - ROW };
  const marks = [
    box(inner(mark), toggle.value ? "accent" : "raised", toggle.value ? null : "line"),
    text(label, toggle.label, { tone: isDimmed ? "dim" : toneOf(toggle), lines: 2 }),
  ];
  if (toggle.value) marks.push({ kind: "tick", rect: inner(mark), tone: "ink" });
  const name = toggle.name ?? toggle.label;
  return one(
    marks,
    unlessRefused(toggle, [region(toggle.id, name, row, () => toggle.to(!toggle.value))]),
  );
}

function inner(rect: Rect): Rect {
  return inset(rect, GAP);
}

function textBlock(label: string, value: string, width: number): Block {
  const height = ROW;
  const left: Rect = { x: 0, y: 0, width: width * LABEL, height };
  const right: Rect = { ...left, x: left.width, width: width - left.width };
  return one(
    [
      text(left, label, { tone: "dim", size: SMALL }),
      text(right, value, { size: SMALL, lines: 2 }),
    ],
    [],
    height,
  );
}

/** Returns the group's colour control that offers colours no other channel has; null if there is none. */
function offered({ controls, more }: Group): Colour | null {
  const colours = [...controls, ...more].filter((each): each is Colour => each.kind === "colour");
  return colours.find(({ free }) => free !== undefined) ?? null;
}

function shownToggle({ controls }: Group): Toggle | null {
  return controls.find((each): each is Toggle => each.kind === "toggle") ?? null;
}

/**
 * Draws a channel or a lamp: its swatch, and its name, which shows and hides it. A glance at the
 * swatch replaces the name by the colours that the channel can have and a button that opens the
 * group's page.
 */
function groupRow(group: Group, width: number, isFanned: boolean): Block {
  const { id, label, isDimmed, tags, controls, more } = group;
  const swatch: Rect = { x: 0, y: 0, width: SWATCH, height: ROW };
  const rest: Rect = { x: SWATCH, y: 0, width: width - SWATCH, height: ROW };
  const colour = [...controls, ...more].find((each): each is Colour => each.kind === "colour");
  const marks: readonly Mark[] =
    colour === undefined ? [text(swatch, "›", { align: "center" })] : swatchMarks(colour, swatch);
  const fan = offered(group);
  const beside =
    fan !== null && isFanned ? fanned(group, fan, rest) : nameRow(group, rest, isDimmed, tags);
  const request = fan === null ? ({ canvas: "group", group: id } as const) : fanOf(id);
  const place = region(`${id}/open`, `${label}: colour and more`, swatch, () => request);
  const glance = { ...place, isGlance: fan !== null };
  return { ...one([...marks, ...beside.marks], [glance, ...beside.regions]), targets: 1 };
}

function fanOf(group: string): CanvasChange {
  return { canvas: "fan", group };
}

/** Draws the colours, and the button that opens the page of the group. */
function fanned({ id, label }: Group, colour: Colour, row: Rect): Block {
  const more: Rect = { ...row, x: row.x + row.width - SWATCH, width: SWATCH };
  const colours = swatches(colour, colour.free ?? [], { ...row, width: row.width - SWATCH });
  const open = region(`${id}/more`, `More of ${label}`, more, () => ({
    canvas: "group",
    group: id,
  }));
  const marks = [
    ...colours.marks,
    box(more, "raised"),
    text(more, "More", { align: "center", size: SMALL }),
  ];
  return one(marks, [...colours.regions, open]);
}

function nameRow(group: Group, row: Rect, isDimmed: boolean, tags: readonly string[]): Block {
  const { id, label } = group;
  const toggle = shownToggle(group);
  if (toggle === null) {
    const open = region(id, label, row, () => ({ canvas: "group", group: id }));
    return one([text(row, label)], [open]);
  }
  return toggleRow({ ...toggle, label: [label, ...tags].join(" · ") }, row, isDimmed);
}

/** Returns the page of a channel or a lamp: its colours first, then all its other controls. */
export function blocksOfGroup(group: Group, width: number): readonly Block[] {
  const colour = offered(group);
  const fan = colour === null ? [] : [freeColours(colour, width)];
  const others = [...group.controls, ...group.more].filter(
    (each) => each.kind !== "colour" || (colour === null && each.palettes.length > 0),
  );
  return [...fan, ...others.flatMap((control) => blocksOf(control, width))];
}

/** Draws two rows of four colours. */
function freeColours(colour: Colour, width: number): Block {
  const free = colour.free ?? [];
  const half = Math.ceil(free.length / 2);
  const [upper, lower] = [free.slice(0, half), free.slice(half)].map((colours, i) =>
    swatches(colour, colours, { x: 0, y: i * ROW, width, height: ROW }),
  );
  const regions = [...upper.regions, ...lower.regions];
  return { ...one([...upper.marks, ...lower.marks], regions, 2 * ROW), targets: 1 };
}
