/**
 * The panel on a canvas: the layout of the HTML panel, one page at a time, in one column of rows.
 * The rows are large enough for a gaze and for a phone's few pixels. The buttons between the pages
 * are in the bar (see bar.ts). Pure.
 */
import type { Control, Group, Layout, Section } from "../controls";
import { blocksOfAll, blocksOfGroup } from "./controls";
import {
  type Block,
  box,
  type Mark,
  moved,
  type Rect,
  type Region,
  ROW,
  SMALL,
  text,
} from "./draw_list";
import { one, region } from "./parts";

/** Size of the texture, px; it does not grow. At 1.2 m it is 55 x 40 degrees wide. */
export const WIDTH = 1024;
export const HEIGHT = 716;
export const PX_PER_M = 820;
/** Largest number of targets on a page. A palette, a map or a histogram has more, and a page of its own. */
export const MAX_TARGETS = 6;

const MARGIN = 16;
const HEADER = 92;
/** Place of the rows, below the title. */
export const CONTENT: Rect = {
  x: MARGIN,
  y: HEADER,
  width: WIDTH - 2 * MARGIN,
  height: HEIGHT - HEADER - MARGIN,
};

/** State of the panel in the scene. */
export type CanvasView = Readonly<{
  /** The open section; null: the list of sections. */
  tab: string | null;
  /** The open group of the section; null: the section itself. */
  group: string | null;
  page: number;
  /** The channel whose colours are drawn over its name, after a glance at its swatch; null: none. */
  fanned: string | null;
}>;
export const START_CANVAS: CanvasView = { tab: "channels", group: null, page: 0, fanned: null };

export type Page = Readonly<{
  title: string;
  marks: readonly Mark[];
  regions: readonly Region[];
  /** Number of the shown page, counted from 0, and the number of all pages. */
  page: number;
  count: number;
  /** Where *Back* leads, one level up; null: this is the list of sections. */
  up: "section" | "list" | null;
}>;

type Item = Control | Group;
type Opened = Readonly<{ title: string; blocks: readonly Block[]; up: Page["up"] }>;

/** Returns the sections that have a control for a headset. */
function shownSections({ sections }: Layout): readonly Section[] {
  return sections.filter(({ items }) => blocksOfAll(items, CONTENT.width).length > 0);
}

/**
 * Distributes blocks (rows and larger pieces) to pages without splitting a block. A page has at
 * most six targets, unless one block has more.
 *
 * @param height height of a page, px
 */
export function paginate(blocks: readonly Block[], height: number): readonly (readonly Block[])[] {
  const pages: Block[][] = [[]];
  let [used, targets] = [0, 0];
  for (const block of blocks) {
    const last = pages[pages.length - 1];
    const count = block.targets ?? block.regions.length;
    const isFull = used + block.height > height || targets + count > MAX_TARGETS;
    if (last.length > 0 && isFull) {
      pages.push([block]);
      [used, targets] = [block.height, count];
    } else {
      last.push(block);
      used += block.height;
      targets += count;
    }
  }
  return pages;
}

export function pageOf(layout: Layout, view: CanvasView): Page {
  const { title, blocks, up } = opened(layout, view);
  const pages = paginate(blocks, CONTENT.height);
  const page = Math.min(view.page, pages.length - 1);
  const whole: Rect = { x: 0, y: 0, width: WIDTH, height: HEIGHT };
  const marks: Mark[] = [
    { kind: "box", rect: whole, fill: "back", stroke: "line", radius: 28 },
    ...header(title, page, pages.length),
  ];
  const regions: Region[] = [];
  let { y } = CONTENT;
  for (const block of pages[page]) {
    const placed = moved(block, CONTENT.x, y);
    marks.push(...placed.marks);
    regions.push(...placed.regions);
    y += block.height;
  }
  return { title, marks, regions, page, count: pages.length, up };
}

/** Returns the open list, section or group. */
function opened(layout: Layout, { tab, group, fanned }: CanvasView): Opened {
  const sections = shownSections(layout);
  const section = tab === null ? undefined : (sections.find(({ id }) => id === tab) ?? sections[0]);
  if (section === undefined) {
    return { title: "Menu", blocks: sections.map(sectionRow), up: null };
  }
  const isOpened = (item: Item): item is Group => item.kind === "group" && item.id === group;
  const open = section.items.find(isOpened);
  if (open !== undefined) {
    return { title: open.label, blocks: blocksOfGroup(open, CONTENT.width), up: "section" };
  }
  const blocks = blocksOfAll(section.items, CONTENT.width, fanned);
  return { title: section.label, blocks, up: "list" };
}

function header(title: string, page: number, count: number): readonly Mark[] {
  const row: Rect = { x: MARGIN, y: 4, width: WIDTH - 2 * MARGIN, height: HEADER - 4 };
  const marks = [text(row, title, { size: 44 })];
  if (count < 2) return marks;
  const number = text(row, `${page + 1} of ${count}`, { align: "right", tone: "dim", size: SMALL });
  return [...marks, number];
}

function sectionRow({ id, label }: Section): Block {
  const rect: Rect = { x: 0, y: 0, width: CONTENT.width, height: ROW };
  const marks = [
    box(rect, "raised"),
    text(rect, label),
    text(rect, "›", { align: "right", tone: "dim" }),
  ];
  return one(marks, [region(`tab=${id}`, label, rect, () => ({ canvas: "tab", section: id }))]);
}
