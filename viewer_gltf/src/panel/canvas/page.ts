/**
 * The panel on a canvas: the same layout as in HTML, one section at a time, so that every row is
 * large enough for the gaze. Pure.
 */
import type { Layout, Section } from "../controls";
import { blocksOfAll } from "./controls";
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

/** Width of the texture, px: it never grows. */
export const WIDTH = 1024;
export const HEIGHT = 640;
/** Pixels to a metre: a row is 37.5 mm, 1.8 degrees at 1.2 m. */
export const PX_PER_M = 1600;

const MARGIN = 16;
const HEADER = 72;
const TABS = 190;
const LEAVE = 130;
const CONTENT: Rect = {
  x: MARGIN + TABS + MARGIN,
  y: HEADER,
  width: WIDTH - TABS - 3 * MARGIN,
  height: HEIGHT - HEADER - MARGIN,
};

/** The plane's memory: the open section, and the open page of it. */
export type CanvasView = Readonly<{ tab: string; page: number }>;
export const START_CANVAS: CanvasView = { tab: "channels", page: 0 };

export type Page = Readonly<{ marks: readonly Mark[]; regions: readonly Region[] }>;

/** A section with nothing for a headset is left out. */
function shownSections({ sections }: Layout): readonly (readonly [Section, readonly Block[]])[] {
  return sections
    .map((each) => [each, blocksOfAll(each.items, CONTENT.width)] as const)
    .filter(([, blocks]) => blocks.length > 0);
}

/** Blocks by page; none is broken. Of several pages each leaves a row for the way to the next. */
export function paginate(blocks: readonly Block[], height: number): readonly (readonly Block[])[] {
  const total = blocks.reduce((sum, block) => sum + block.height, 0);
  if (total <= height) return [blocks];
  const pages: Block[][] = [[]];
  let used = 0;
  for (const block of blocks) {
    const last = pages[pages.length - 1];
    if (last.length > 0 && used + block.height > height - ROW) {
      pages.push([block]);
      used = block.height;
    } else {
      last.push(block);
      used += block.height;
    }
  }
  return pages;
}

export function pageOf(layout: Layout, view: CanvasView): Page {
  const marks: Mark[] = [
    {
      kind: "box",
      rect: { x: 0, y: 0, width: WIDTH, height: HEIGHT },
      fill: "back",
      stroke: "line",
      radius: 0,
    },
  ];
  const regions: Region[] = [];
  const add = (block: Block) => {
    marks.push(...block.marks);
    regions.push(...block.regions);
  };
  add(header(layout));
  const sections = shownSections(layout);
  const open = sections.find(([{ id }]) => id === view.tab) ?? sections[0];
  if (open === undefined) return { marks, regions };
  const [{ id: tab }, blocks] = open;
  add(
    moved(
      tabs(
        sections.map(([section]) => section),
        tab,
      ),
      MARGIN,
      HEADER,
    ),
  );
  const pages = paginate(blocks, CONTENT.height);
  const page = Math.min(view.page, pages.length - 1);
  let y = CONTENT.y;
  for (const block of pages[page]) {
    add(moved(block, CONTENT.x, y));
    y += block.height;
  }
  if (pages.length > 1) add(pager(page, pages.length));
  return { marks, regions };
}

function header({ title, status }: Layout): Block {
  const row: Rect = { x: MARGIN, y: 0, width: WIDTH - 2 * MARGIN, height: HEADER };
  const close: Rect = { x: WIDTH - MARGIN - LEAVE, y: 6, width: LEAVE, height: ROW };
  const leave: Rect = { ...close, x: close.x - LEAVE };
  const words: Rect = { ...row, width: leave.x - row.x };
  const top: Rect = { ...words, y: 2, height: 42 };
  const below: Rect = { ...words, y: 36, height: 34 };
  const marks = [
    text(top, title),
    text(below, status, { size: SMALL - 2, tone: "dim" }),
    box(leave, "raised"),
    text(leave, "Leave", { align: "center", size: SMALL + 2 }),
    box(close, "raised"),
    text(close, "Close", { align: "center", size: SMALL + 2 }),
  ];
  return {
    height: HEADER,
    marks,
    regions: [
      {
        id: "leave",
        label: "Leave stereo",
        rect: leave,
        isSlide: false,
        to: () => ({ canvas: "leave" }),
      },
      { id: "close", label: "Close", rect: close, isSlide: false, to: () => ({ canvas: "close" }) },
    ],
  };
}

function tabs(sections: readonly Section[], open: string): Block {
  const marks: Mark[] = [];
  const regions: Region[] = [];
  const height = Math.min(ROW, Math.floor(CONTENT.height / sections.length));
  sections.forEach(({ id, label }, i) => {
    const rect: Rect = { x: 0, y: i * height, width: TABS, height };
    if (id === open) marks.push(box(rect, "raised", "accent"));
    marks.push(text(rect, label, { tone: id === open ? "text" : "dim", size: SMALL + 2 }));
    regions.push({
      id: `tab=${id}`,
      label,
      rect,
      isSlide: false,
      to: () => ({ canvas: "tab", section: id }),
    });
  });
  return { height: sections.length * height, marks, regions };
}

function pager(page: number, count: number): Block {
  const rect: Rect = { ...CONTENT, y: CONTENT.y + CONTENT.height - ROW, height: ROW };
  const label = `More (${page + 1} of ${count})`;
  return {
    height: ROW,
    marks: [box(rect, "raised"), text(rect, label, { align: "center", size: SMALL + 2 })],
    regions: [
      {
        id: "more",
        label,
        rect,
        isSlide: false,
        isStep: true,
        to: () => ({ canvas: "page", page: (page + 1) % count }),
      },
    ],
  };
}
