/**
 * The controls of a layout as rows of the panel on a canvas, each tall enough to be gazed at. Pure.
 */
import type { Button, Choice, Control, Group, Search, Slider, Toggle } from "../controls";
import { chips, mapBlock, nextSwatch, palettes, stepper } from "./choices";
import {
  type Block,
  box,
  GAP,
  type Mark,
  type Rect,
  type Region,
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
 * Controls without use before the eyes: the way into stereo, from which *Leave* leads back, the code of a
 * phone viewer, which is read with the phone out of it, the screen's size, which is measured by a
 * card held to it, files of the user's, the list of a keyboard's keys, and pictures beside the specimen.
 */
export const ELSEWHERE: ReadonlySet<string> = new Set([
  ...["stereo", "split"],
  ...["scan", "lens-code", "measure-screen"],
  ...["own-light", "save-csv", "save-objects"],
  "slice-pictures", // the planes in the specimen are what a headset shows
  // of the screen's camera, as files
  ...["picture-size", "save-picture", "save-video", "keep-view", "next-view", "forget-views"],
  "help",
]);
/** Widths in a channel's row. */
const CHIP = 150;
const SWATCH = 80;

export function blocksOf(item: Control | Group, width: number): readonly Block[] {
  if (item.kind === "group") return groupBlocks(item, width);
  if (ELSEWHERE.has(item.id)) return [];
  const row: Rect = { x: 0, y: 0, width, height: ROW };
  switch (item.kind) {
    case "toggle":
      return [toggleRow(item, row)];
    case "button":
      return [buttonIn(item, row)];
    case "slider":
      return [sliderRow(item, row), ...aboutOf(item, width)];
    case "window":
      return [windowRow(item, 0, row), windowRow(item, 1, row)];
    case "choice":
      return [item.isInline ? chips(item, width) : stepper(item, row)];
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
      return [textBlock(item.label, "It is in the page's address: take it from there.", width)];
  }
}

/** What a slider does, in a sentence; those of light, whose list is long as it is, say it on the page alone. */
function aboutOf({ id, about }: Slider, width: number): readonly Block[] {
  return about && !id.startsWith("trace/") ? [textBlock("", about, width)] : [];
}

/** Nobody types by gaze: one hint after the other. */
function asChoice({ id, value, to }: Search, hints: readonly string[]): Choice {
  const options = ["", ...hints].map((hint) => ({ value: hint, label: hint || "all" }));
  return { kind: "choice", id, label: "Begins with", value, options, isInline: false, to };
}

/** The blocks of a section; buttons that go on while they are held share a row with their opposite. */
export function blocksOfAll(items: readonly (Control | Group)[], width: number): readonly Block[] {
  const blocks: Block[] = [];
  for (let i = 0; i < items.length; i++) {
    const [item, next] = [items[i], items[i + 1]];
    if (isRepeating(item) && next !== undefined && isRepeating(next)) {
      const rects = split({ x: 0, y: 0, width, height: ROW }, 2);
      const [left, right] = [buttonIn(item, rects[0]), buttonIn(next, rects[1])];
      blocks.push(
        one([...left.marks, ...right.marks], [...left.regions, ...right.regions], ROW + GAP),
      );
      i++;
    } else blocks.push(...blocksOf(item, width));
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

function toggleRow(toggle: Toggle, row: Rect): Block {
  const mark: Rect = { ...row, width: ROW };
  const label: Rect = { ...row, x: row.x + ROW, width: row.width - ROW };
  const marks = [
    box(inner(mark), toggle.value ? "accent" : "raised", toggle.value ? null : "line"),
    text(label, toggle.label, { tone: toneOf(toggle) }),
  ];
  if (toggle.value) marks.push({ kind: "tick", rect: inner(mark), tone: "ink" });
  const label_ = toggle.name ?? toggle.label;
  return one(
    marks,
    unlessRefused(toggle, [region(toggle.id, label_, row, () => toggle.to(!toggle.value))]),
  );
}

function inner({ x, y, width, height }: Rect): Rect {
  return { x: x + 8, y: y + 8, width: width - 16, height: height - 16 };
}

/** A toggle among others in a row: lit while it is on. */
function chip(toggle: Toggle, rect: Rect): Block {
  const isOn = toggle.value && !toggle.refusal;
  return one(
    [
      box(rect, isOn ? "accent" : "raised", isOn ? null : "line"),
      text(rect, toggle.label, { align: "center", tone: toneOf(toggle, isOn) }),
    ],
    unlessRefused(toggle, [
      region(toggle.id, toggle.name ?? toggle.label, rect, () => toggle.to(!toggle.value)),
    ]),
  );
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

/** A channel: colour, name and what is switched in one row; the rest while it is open. */
function groupBlocks(group: Group, width: number): readonly Block[] {
  const inRow = group.controls.filter(({ kind }) => kind === "colour" || kind === "toggle");
  const below = [...group.controls.filter((each) => !inRow.includes(each)), ...group.more];
  const marks: Mark[] = [];
  const regions: Region[] = [];
  const add = ({ marks: more, regions: places }: Block) => {
    marks.push(...more);
    regions.push(...places);
  };
  let [left, right] = [0, width];
  for (const control of inRow) {
    if (control.kind !== "colour") continue;
    add(nextSwatch(control, { x: left, y: 0, width: SWATCH, height: ROW }));
    left += SWATCH;
  }
  for (const control of inRow) {
    if (control.kind !== "toggle") continue;
    right -= CHIP;
    add(chip(control, { x: right, y: 0, width: CHIP, height: ROW }));
  }
  const name: Rect = { x: left, y: 0, width: right - left, height: ROW };
  const canOpen = group.controls.length > 1 || group.more.length > 0;
  const sign = canOpen ? (group.isOpen ? "▾ " : "▸ ") : "";
  const tags = group.tags.length === 0 ? "" : ` (${group.tags.join(", ")})`;
  const tone = group.isDimmed ? "dim" : "text";
  marks.push(text(name, `${sign}${group.label}${tags}`, { tone }));
  if (canOpen) regions.push(region(`${group.id}/open`, group.label, name, () => group.opener));
  const head = one(marks, regions);
  if (!group.isOpen) return [head];
  return [head, ...below.flatMap((control) => blocksOf(control, width))];
}
