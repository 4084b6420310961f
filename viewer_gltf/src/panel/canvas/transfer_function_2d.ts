/** The joint histogram with its shapes, on the page's canvas and on the panel's canvas. Pure. */

import type { Shape } from "../../bundle/transfer_2d";
import { type Rgb, toHex } from "../../math/color";
import { type HistogramPoint, outline } from "../../state/transfer_shapes";
import type { HistogramEditor } from "../controls";
import { type Block, type Mark, type Rect, SMALL, text } from "./draw_list";
import { captioned, one, region, unlessRefused } from "./parts";

/** Height of the histogram on the panel, px. */
const HEIGHT = 440;
/** Space for the texts of the axes, px. */
const AXIS = 52;
/**
 * Largest distance from a corner or an edge at which a ray grabs it, px; large because a ray
 * trembles.
 */
const REACH = 36;
const HANDLE = 32;

/** Returns the corners that are drawn as handles. */
function handlesOf(shape: Shape): readonly HistogramPoint[] {
  const corners = outline(shape);
  if (shape.kind === "rectangle") return corners;
  const [bottom, top] = shape.gradients;
  const upper = corners.filter(({ gradient }) => gradient === top);
  const tip = { value: shape.tip, gradient: 0 };
  return [...upper, tip, ...(bottom > 0 ? [{ value: middleAt(shape), gradient: bottom }] : [])];
}

/**
 * Returns the intensity in the middle of a triangle's lower edge, where it is cut off above its
 * tip.
 */
function middleAt({ values: [low, high], gradients: [bottom, top], tip }: Shape): number {
  return tip + (((low + high) / 2 - tip) * bottom) / top;
}

/** Returns the displayed colour of a shape: the channel's colour times its own. */
function toneOf(shape: Shape, color: Rgb): `#${string}` {
  const [r, g, b] = color;
  return `#${toHex([r * shape.color[0], g * shape.color[1], b * shape.color[2]]).slice(1)}`;
}

/** @param handle width of a handle, px */
export function histogramMarks(
  editor: HistogramEditor,
  rect: Rect,
  handle: number,
): readonly Mark[] {
  const { histogram, shapes, selected, color, window } = editor;
  const marks: Mark[] = [{ kind: "box", rect, fill: "ink", stroke: "line", radius: 0 }];
  if (histogram !== null) marks.push({ kind: "histogram", rect, histogram, window });
  const place = ({ value, gradient }: HistogramPoint) => ({
    x: rect.x + value * rect.width,
    y: rect.y + (1 - gradient) * rect.height,
  });
  shapes.forEach((shape, i) => {
    marks.push({
      kind: "outline",
      rect,
      corners: outline(shape).map(({ value, gradient }) => [value, 1 - gradient]),
      fill: toneOf(shape, color),
      opacity: 0.15 + 0.35 * shape.opacity,
      stroke: i === selected ? "text" : "dim",
    });
  });
  if (selected === null) return marks;
  for (const corner of handlesOf(shapes[selected])) {
    const { x, y } = place(corner);
    const at = { x: x - handle / 2, y: y - handle / 2, width: handle, height: handle };
    marks.push({ kind: "box", rect: at, fill: "text", stroke: "ink", radius: handle / 2 });
  }
  return marks;
}

export function histogramBlock(editor: HistogramEditor, width: number): Block {
  const rect: Rect = { x: REACH, y: 0, width: width - 2 * REACH, height: HEIGHT };
  const below: Rect = { ...rect, y: HEIGHT, height: AXIS };
  const [low, high, steepest] = editor.texts;
  const style = { size: SMALL, tone: "dim" } as const;
  const marks = [
    ...histogramMarks(editor, rect, HANDLE),
    text(below, low, style),
    text(below, high, { ...style, align: "right" }),
    text({ ...rect, height: AXIS }, steepest, style),
  ];
  const pointAt = (across: number, down = 0): HistogramPoint => ({
    value: across,
    gradient: 1 - down,
  });
  const reach = { value: REACH / rect.width, gradient: REACH / rect.height };
  const held = {
    ...region(
      editor.id,
      editor.label,
      rect,
      (across, down) => editor.drag(pointAt(across, down)),
      true,
    ),
    press: (across: number, down: number) => editor.press(pointAt(across, down), reach),
  };
  const block = one(marks, unlessRefused(editor, [held]), HEIGHT + AXIS);
  return captioned("Value to the right, gradient up", width, block);
}
