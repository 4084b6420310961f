/** Marks to paint and regions to point at, of which the panel on a canvas consists. Pixels. Pure. */

import type { Command } from "../../state/commands";
import type { Histogram, Request } from "../controls";

/** x and y are from the upper left corner of the canvas. */
export type Rect = Readonly<{ x: number; y: number; width: number; height: number }>;

/** Colours by their role in the panel, or `#rrggbb`. */
export type Tone = "back" | "raised" | "line" | "text" | "dim" | "accent" | "ink" | `#${string}`;

export type Mark =
  | Readonly<{ kind: "box"; rect: Rect; fill: Tone | null; stroke: Tone | null; radius: number }>
  | Readonly<{
      kind: "text";
      rect: Rect;
      text: string;
      tone: Tone;
      align: "left" | "center" | "right";
      size: number;
      /** Largest number of lines; the last one ends with an ellipsis if text is left. */
      lines: number;
    }>
  | Readonly<{ kind: "tick"; rect: Rect; tone: Tone }>
  /** `corners` in the rect, 0..1 from its upper left corner. */
  | Readonly<{
      kind: "outline";
      rect: Rect;
      corners: readonly (readonly [number, number])[];
      fill: Tone;
      opacity: number;
      stroke: Tone;
    }>
  /** `window`: the range of the histogram's values that fills the width of the rect. */
  | Readonly<{
      kind: "histogram";
      rect: Rect;
      histogram: Histogram;
      window: readonly [number, number];
    }>
  /** A picture that its owner draws; `version` changes with its content. */
  | Readonly<{
      kind: "picture";
      rect: Rect;
      version: string;
      draw: (context: CanvasRenderingContext2D, width: number, height: number) => void;
    }>;

/** Changes of the panel in the scene only, which shows one page at a time. */
export type CanvasChange =
  | Readonly<{ canvas: "open" }>
  /** Opens a section; `section` null opens the list of all sections. */
  | Readonly<{ canvas: "tab"; section: string | null }>
  /** Shows the colours that a channel can have beside its swatch. */
  | Readonly<{ canvas: "fan"; group: string }>
  /** Opens the page of a channel or a lamp of the section. */
  | Readonly<{ canvas: "group"; group: string }>
  | Readonly<{ canvas: "page"; page: number }>
  /** Goes one level up: from a group to its section, or from a section to the list. */
  | Readonly<{ canvas: "back" }>
  /** Undoes the last choice. */
  | Readonly<{ canvas: "undo" }>
  /** Lets the specimen follow the gaze until the gaze rests. */
  | Readonly<{ canvas: "carry" }>
  /** Reports why a request is refused. */
  | Readonly<{ canvas: "announce"; text: string }>
  | Readonly<{ canvas: "close" }>
  | Readonly<{ canvas: "leave" }>;

export type CanvasRequest = Request | CanvasChange;

/**
 * A target for a ray. `to` gets the point in the region that the ray hits, 0..1 from the left and
 * from the upper edge, and returns a request; null: nothing changes.
 */
export type Region = Readonly<{
  id: string;
  /** Label for tests, and for programs that read the panel aloud. */
  label: string;
  rect: Rect;
  isSlide: boolean;
  to: (across: number, down?: number) => CanvasRequest | null;
  /** Request at the start of a drag, if that does not yet move anything. */
  press?: (across: number, down: number) => CanvasRequest;
  /** Command that is repeated while the region is held or gazed at. */
  repeats?: Command;
  /**
   * Whether each press moves on by a step, for example to the next option, so that quick presses
   * all count.
   */
  isStep?: boolean;
  /** Whether the region carries the specimen (see `carry` above). */
  isCarry?: boolean;
  /** Whether a short look is enough, because only the panel changes. There is no dwell then. */
  isGlance?: boolean;
}>;

/** A row, or a larger piece that is not split between pages. Its upper left corner is 0, 0. */
export type Block = Readonly<{
  height: number;
  marks: readonly Mark[];
  regions: readonly Region[];
  /**
   * Number that the block counts toward MAX_TARGETS of a page; absent: the number of its regions.
   */
  targets?: number;
}>;

/** Height of a row, px; six rows fill a page. */
export const ROW = 100;
export const GAP = 12;
/**
 * Font sizes, px. The smaller one is 35 mm at 1 m: the height of its x takes 6 pixels of a phone of
 * 1600 x 720 in either Cardboard (xr/legibility.test.ts).
 */
const TEXT = 38;
export const SMALL = 34;

/** Returns the part of a row that is painted. */
export function inset({ x, y, width, height }: Rect, by = GAP / 2): Rect {
  return { x: x + by, y: y + by, width: width - 2 * by, height: height - 2 * by };
}

export function box(rect: Rect, fill: Tone | null, stroke: Tone | null = null): Mark {
  return { kind: "box", rect: inset(rect), fill, stroke, radius: 10 };
}

export function text(
  rect: Rect,
  words: string,
  { tone = "text", align = "left", size = TEXT, lines = 1 }: Partial<TextStyle> = {},
): Mark {
  return { kind: "text", rect: inset(rect, GAP), text: words, tone, align, size, lines };
}
type TextStyle = Omit<Extract<Mark, { kind: "text" }>, "kind" | "rect" | "text">;

/** Splits a row into equal parts side by side. */
export function split(rect: Rect, count: number): readonly Rect[] {
  const width = rect.width / count;
  return Array.from({ length: count }, (_, i) => ({ ...rect, x: rect.x + i * width, width }));
}

export function moved(block: Block, dx: number, dy: number): Block {
  const by = (rect: Rect): Rect => ({ ...rect, x: rect.x + dx, y: rect.y + dy });
  return {
    ...block,
    marks: block.marks.map((mark) => ({ ...mark, rect: by(mark.rect) })),
    regions: block.regions.map((region) => ({ ...region, rect: by(region.rect) })),
  };
}

export function holds({ x, y, width, height }: Rect, at: Readonly<{ x: number; y: number }>) {
  return at.x >= x && at.x < x + width && at.y >= y && at.y < y + height;
}
