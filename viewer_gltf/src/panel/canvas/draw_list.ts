/** What the panel on a canvas is made of: marks to paint and regions to point at. Pixels. Pure. */

import type { Command } from "../../state/commands";
import type { Histogram, Wish } from "../controls";

/** From the upper left corner. */
export type Rect = Readonly<{ x: number; y: number; width: number; height: number }>;

/** Colours by their part in the panel, or `#rrggbb`. */
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
      /** As many lines as may be broken into; the last one ends with an ellipsis. */
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
  /** `window`: the part of its values that the rect is as wide as. */
  | Readonly<{
      kind: "histogram";
      rect: Rect;
      histogram: Histogram;
      window: readonly [number, number];
    }>
  /** Another's; `version` changes with what it is. */
  | Readonly<{
      kind: "picture";
      rect: Rect;
      version: string;
      draw: (context: CanvasRenderingContext2D, width: number, height: number) => void;
    }>;

/** The changes of the panel in the scene that are its own: it shows one page at a time. */
export type CanvasChange =
  | Readonly<{ canvas: "open" }>
  /** Open a section; null: the list of all sections. */
  | Readonly<{ canvas: "tab"; section: string | null }>
  /** Lay the colours that a channel can have beside its swatch. */
  | Readonly<{ canvas: "fan"; group: string }>
  /** Open the page of one group of the section: of a channel or a lamp. */
  | Readonly<{ canvas: "group"; group: string }>
  | Readonly<{ canvas: "page"; page: number }>
  /** One level up: from a group to its section, from a section to the list. */
  | Readonly<{ canvas: "back" }>
  /** Undo the last choice. */
  | Readonly<{ canvas: "undo" }>
  /** The specimen follows the gaze until the gaze rests. */
  | Readonly<{ canvas: "carry" }>
  /** Report why a request is refused. */
  | Readonly<{ canvas: "announce"; text: string }>
  | Readonly<{ canvas: "close" }>
  | Readonly<{ canvas: "leave" }>;

export type CanvasWish = Wish | CanvasChange;

/**
 * Where a ray does something. `to` gets where in the region it is, 0..1 from its left edge and from
 * its upper one; null: nothing changes by it.
 */
export type Region = Readonly<{
  id: string;
  /** For tests and for programs that read the panel aloud. */
  label: string;
  rect: Rect;
  isSlide: boolean;
  to: (across: number, down?: number) => CanvasWish | null;
  /** What taking hold of it does, where that is something else than to drag it. */
  press?: (across: number, down: number) => CanvasWish;
  /** Goes on, little by little, while it is held or gazed at. */
  repeats?: Command;
  /** Each press moves on by a step, for example to the next option, so quick presses all count. */
  isStep?: boolean;
  /** The specimen is carried by it: see `carry` above. */
  isCarry?: boolean;
  /** A short look at it is enough, since it changes nothing but the panel; so it has no dwell. */
  isGlance?: boolean;
}>;

/** A row, or what must not be broken; its upper left corner is 0, 0. */
export type Block = Readonly<{
  height: number;
  marks: readonly Mark[];
  regions: readonly Region[];
  /** The targets that count on a page; absent: its regions. */
  targets?: number;
}>;

/** Height of a row: six fill a page. */
export const ROW = 100;
export const GAP = 12;
/**
 * Sizes of letters. The smaller one is 35 mm at 1 m: its x-height takes 6 pixels of a phone of 1600 x 720
 * in either Cardboard (xr/legibility.test.ts).
 */
const TEXT = 38;
export const SMALL = 34;

/** The part of a row that is painted. */
export function inset({ x, y, width, height }: Rect, by = GAP / 2): Rect {
  return { x: x + by, y: y + by, width: width - 2 * by, height: height - 2 * by };
}

export function box(rect: Rect, fill: Tone | null, stroke: Tone | null = null): Mark {
  return { kind: "box", rect: inset(rect), fill, stroke, radius: 10 };
}

export function text(
  rect: Rect,
  words: string,
  { tone = "text", align = "left", size = TEXT, lines = 1 }: Partial<TextLook> = {},
): Mark {
  return { kind: "text", rect: inset(rect, GAP), text: words, tone, align, size, lines };
}
type TextLook = Omit<Extract<Mark, { kind: "text" }>, "kind" | "rect" | "text">;

/** Parts of a row, side by side. */
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
