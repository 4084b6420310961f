/** Scale bar, legend and orientation on a saved picture, as they lie over the stage. */

import type { Matrix4 } from "three";
import { type Axis, axesSeen } from "../annotations/orientation_axes";
import { AXIS_COLORS } from "../annotations/style";
import { chooseScaleBar } from "../math/round_length";

export type LegendEntry = Readonly<{ name: string; hex: string; range: string }>;

export type Caption = Readonly<{
  /** Of the screen, at what is looked at; null: there is no scale. */
  um_per_px: number | null;
  legend: readonly LegendEntry[];
  axes: readonly Axis[];
  head: Matrix4;
  specimen: Matrix4;
}>;

const FONT = 'system-ui, "Noto Sans", sans-serif';
const EDGE = 16;
const LINE = 20;

/** @param scale pixels of the picture to one of the screen */
export function drawCaption(
  context: CanvasRenderingContext2D,
  { width, height }: Readonly<{ width: number; height: number }>,
  scale: number,
  { um_per_px, legend, axes, head, specimen }: Caption,
): void {
  context.save();
  context.scale(scale, scale);
  const [right, bottom] = [width / scale, height / scale];
  context.shadowColor = "#000";
  context.shadowBlur = 3 * scale;
  context.textBaseline = "middle";
  context.lineCap = "round";
  if (um_per_px !== null) drawScaleBar(context, bottom, um_per_px);
  drawLegend(context, legend);
  drawAxes(context, right - 48, bottom - 46, axes, axesSeen(head, specimen, axes));
  context.restore();
}

function drawScaleBar(context: CanvasRenderingContext2D, bottom: number, um_per_px: number): void {
  const bar = chooseScaleBar(um_per_px);
  if (bar === null) return;
  const y = bottom - 36;
  context.strokeStyle = context.fillStyle = "#fff";
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(EDGE, y - 4);
  context.lineTo(EDGE, y);
  context.lineTo(EDGE + bar.length_px, y);
  context.lineTo(EDGE + bar.length_px, y - 4);
  context.stroke();
  context.font = `13px ${FONT}`;
  context.textAlign = "left";
  context.fillText(bar.label, EDGE, y + 14);
}

function drawLegend(context: CanvasRenderingContext2D, legend: readonly LegendEntry[]): void {
  context.textAlign = "left";
  legend.forEach(({ name, hex, range }, i) => {
    const y = EDGE + 6 + i * LINE;
    context.fillStyle = hex;
    context.beginPath();
    context.arc(EDGE + 6, y, 6, 0, 2 * Math.PI);
    context.fill();
    context.fillStyle = "#fff";
    context.font = `600 13px ${FONT}`;
    context.fillText(name, EDGE + 20, y);
    const after = EDGE + 28 + context.measureText(name).width;
    context.font = `12px ${FONT}`;
    context.fillStyle = "#cfd6e4";
    context.fillText(range, after, y);
  });
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
    const isBehind = axes[i].ends[1] !== null && at.z < -0.9; // its opposite lies over it
    if (!isBehind) context.fillText(text, x + 33 * at.x, y - 33 * at.y);
  }
  context.globalAlpha = 1;
}
