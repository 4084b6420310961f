/** Draws scale bar, legend and axes on a saved image, like those over the view on the screen. */

import type { Matrix4 } from "three";
import { type Axis, axesSeen } from "../marks/axes";
import { AXIS_COLORS } from "../marks/style";
import { chooseScaleBar } from "../math/round_length";
import { type Corner, clearestOf, inCorners, type Rect } from "./label_boxes";

/** A line of the legend. One colour is a dot, several are a gradient bar, and none means text only. */
export type LegendEntry = Readonly<{ name: string; colors: readonly string[]; text: string }>;

export type Caption = Readonly<{
  /** Scale at the camera's target, um per CSS pixel of the screen; null if there is no scale. */
  um_per_px: number | null;
  legend: readonly LegendEntry[];
  axes: readonly Axis[];
  head: Matrix4;
  specimen: Matrix4;
  /** Whether the background is light, so that texts are dark. */
  isLight: boolean;
  /** Boxes of labels in the image, pixels of the screen; the caption avoids them. */
  labels: readonly Rect[];
}>;

/** Colours of a caption: `ink` for the scale bar and names, `halo` for their outline, `faint` for other texts. */
const DARK_INKS = { ink: "#fff", halo: "#000", faint: "#cfd6e4" } as const;
const LIGHT_INKS = { ink: "#1a1f29", halo: "#fff", faint: "#3d4656" } as const;
type Inks = Readonly<Record<keyof typeof DARK_INKS, string>>;

const FONT = 'system-ui, "Noto Sans", sans-serif';
const BAR_FONT = `13px ${FONT}`;
const NAME_FONT = `600 13px ${FONT}`;
const TEXT_FONT = `12px ${FONT}`;
const EDGE = 16;
const LINE = 20;
const BAR_HEIGHT = 28;
/** Edge of the square around the axes, CSS pixels. */
const AXES = 84;

const CORNERS = {
  bar: ["bottom-left", "bottom-right", "top-right", "top-left"],
  axes: ["bottom-right", "top-right", "bottom-left", "top-left"],
  legend: ["top-left", "top-right", "bottom-left", "bottom-right"],
} as const satisfies Readonly<Record<string, readonly Corner[]>>;

/** @param scale pixels of the image for each CSS pixel of the screen */
export function drawCaption(
  context: CanvasRenderingContext2D,
  { width, height }: Readonly<{ width: number; height: number }>,
  scale: number,
  { um_per_px, legend, axes, head, specimen, labels, isLight }: Caption,
): void {
  context.save();
  context.scale(scale, scale);
  const picture = { width: width / scale, height: height / scale };
  const taken = [...labels];
  const placeFor = (what: keyof typeof CORNERS, width: number, height: number): Rect => {
    const place = clearestOf(inCorners(CORNERS[what], { width, height }, picture, EDGE), taken);
    taken.push(place);
    return place;
  };
  const inks = isLight ? LIGHT_INKS : DARK_INKS;
  context.shadowColor = inks.halo;
  context.shadowBlur = 3 * scale;
  context.textBaseline = "middle";
  context.lineCap = "round";
  const bar = um_per_px === null ? null : chooseScaleBar(um_per_px);
  if (bar !== null) {
    context.font = BAR_FONT;
    const { width } = context.measureText(bar.label);
    const place = placeFor("bar", Math.max(bar.length_px, width), BAR_HEIGHT);
    context.strokeStyle = context.fillStyle = inks.ink;
    drawScaleBar(context, place, bar);
  }
  const square = placeFor("axes", AXES, AXES);
  const middle = AXES / 2;
  // The axes' colours are made for a dark background.
  if (isLight) context.filter = "brightness(0.6)";
  drawAxes(context, square.x + middle, square.y + middle, axes, axesSeen(head, specimen, axes));
  context.filter = "none";
  drawLegend(
    context,
    placeFor("legend", legendWidth(context, legend), LINE * legend.length),
    legend,
    inks,
  );
  context.restore();
}

function drawScaleBar(
  context: CanvasRenderingContext2D,
  { x, y }: Rect,
  { length_px, label }: Readonly<{ length_px: number; label: string }>,
): void {
  const line = y + 6;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(x, line - 4);
  context.lineTo(x, line);
  context.lineTo(x + length_px, line);
  context.lineTo(x + length_px, line - 4);
  context.stroke();
  context.font = BAR_FONT;
  context.textAlign = "left";
  context.fillText(label, x, line + 14);
}

/** Widths of the dot and of the bar, which come before the name and the text, CSS pixels. */
const [DOT, BAR] = [12, 72];
const GAP = 8;

const markOf = ({ colors }: LegendEntry) =>
  colors.length === 0 ? 0 : GAP + (colors.length === 1 ? DOT : BAR);

function legendWidth(context: CanvasRenderingContext2D, legend: readonly LegendEntry[]): number {
  const widths = legend.map((entry) => {
    context.font = NAME_FONT;
    const named = entry.name === "" ? 0 : context.measureText(entry.name).width + GAP;
    context.font = TEXT_FONT;
    return markOf(entry) + named + context.measureText(entry.text).width;
  });
  return Math.max(0, ...widths);
}

function drawLegend(
  context: CanvasRenderingContext2D,
  { x, y: top }: Rect,
  legend: readonly LegendEntry[],
  { ink, faint }: Inks,
): void {
  context.textAlign = "left";
  legend.forEach((entry, i) => {
    const { name, colors, text } = entry;
    const y = top + 6 + i * LINE;
    drawMark(context, x, y, colors);
    let at = x + markOf(entry);
    if (name !== "") {
      context.fillStyle = ink;
      context.font = NAME_FONT;
      context.fillText(name, at, y);
      at += context.measureText(name).width + GAP;
    }
    context.font = TEXT_FONT;
    context.fillStyle = faint;
    context.fillText(text, at, y);
  });
}

function drawMark(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  colors: LegendEntry["colors"],
): void {
  if (colors.length === 0) return;
  context.beginPath();
  if (colors.length === 1) {
    context.fillStyle = colors[0];
    context.arc(x + DOT / 2, y, DOT / 2, 0, 2 * Math.PI);
  } else {
    const across = context.createLinearGradient(x, y, x + BAR, y);
    for (const [i, color] of colors.entries()) across.addColorStop(i / (colors.length - 1), color);
    context.fillStyle = across;
    context.rect(x, y - DOT / 2, BAR, DOT);
  }
  context.fill();
}

function drawAxes(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  axes: readonly Axis[],
  seen: ReturnType<typeof axesSeen>,
): void {
  const ends = axes.flatMap(({ ends: [forth, back] }, i) => [
    { text: forth, i, at: seen[i] },
    ...(back === null ? [] : [{ text: back, i, at: seen[i].clone().negate() }]),
  ]);
  context.textAlign = "center";
  context.font = `600 12px ${FONT}`;
  context.lineWidth = 3;
  for (const { text, i, at } of ends.sort((a, b) => a.at.z - b.at.z)) {
    context.globalAlpha = at.z < -0.1 ? 0.55 : 1;
    context.strokeStyle = context.fillStyle = AXIS_COLORS[i];
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + 26 * at.x, y - 26 * at.y);
    context.stroke();
    const isBehind = axes[i].ends[1] !== null && at.z < -0.9; // the letter at the opposite end covers this one
    if (!isBehind) context.fillText(text, x + 33 * at.x, y - 33 * at.y);
  }
  context.globalAlpha = 1;
}
