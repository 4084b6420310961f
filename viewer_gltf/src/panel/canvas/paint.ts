/** Paints marks on a 2D canvas. */

import type { Mark, Rect, Tone } from "./draw_list";
import { histogramPicture } from "./histogram_image";

/** Colours of the page (see html/colors.css). */
const COLORS: Readonly<Record<string, string>> = {
  back: "#12151d",
  raised: "#242b39",
  line: "#3a4458",
  text: "#e6e9f0",
  dim: "#a3adbd",
  accent: "#5aa9ff",
  ink: "#0b0d12",
};
const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif";

function colorOf(tone: Tone): string {
  return COLORS[tone] ?? tone;
}

export function paint(context: CanvasRenderingContext2D, marks: readonly Mark[]): void {
  for (const mark of marks) {
    if (mark.kind === "box") paintBox(context, mark);
    else if (mark.kind === "text") paintText(context, mark);
    else if (mark.kind === "outline") paintOutline(context, mark);
    else if (mark.kind === "histogram") paintHistogram(context, mark);
    else if (mark.kind === "picture") paintPicture(context, mark);
    else paintTick(context, mark.rect, mark.tone);
  }
}

type Context = CanvasRenderingContext2D;

function paintBox(context: Context, mark: Extract<Mark, { kind: "box" }>): void {
  const { x, y, width, height } = mark.rect;
  if (width <= 0 || height <= 0) return;
  context.beginPath();
  context.roundRect(x, y, width, height, mark.radius);
  if (mark.fill !== null) {
    context.fillStyle = colorOf(mark.fill);
    context.fill();
  }
  if (mark.stroke === null) return;
  context.lineWidth = 4;
  context.strokeStyle = colorOf(mark.stroke);
  context.stroke();
}

function paintOutline(context: Context, mark: Extract<Mark, { kind: "outline" }>): void {
  const { x, y, width, height } = mark.rect;
  context.beginPath();
  mark.corners.forEach(([across, down], i) => {
    const at = [x + across * width, y + down * height] as const;
    if (i === 0) context.moveTo(...at);
    else context.lineTo(...at);
  });
  context.closePath();
  context.globalAlpha = mark.opacity;
  context.fillStyle = colorOf(mark.fill);
  context.fill();
  context.globalAlpha = 1;
  context.lineWidth = 3;
  context.strokeStyle = colorOf(mark.stroke);
  context.stroke();
}

function paintPicture(context: Context, mark: Extract<Mark, { kind: "picture" }>): void {
  const { x, y, width, height } = mark.rect;
  context.save();
  context.translate(x, y);
  mark.draw(context, width, height);
  context.restore();
}

/** Draws the part of the histogram inside a window: the same share of the values and of the gradients. */
function paintHistogram(context: Context, mark: Extract<Mark, { kind: "histogram" }>): void {
  const picture = histogramPicture(mark.histogram);
  const { x, y, width, height } = mark.rect;
  const [low, high] = mark.window;
  const share = high - low;
  const { width: columns, height: rows } = picture;
  context.drawImage(
    picture,
    low * columns,
    (1 - share) * rows,
    share * columns,
    share * rows,
    ...([x, y, width, height] as const),
  );
}

function paintText(context: Context, mark: Extract<Mark, { kind: "text" }>): void {
  const { rect, size, align } = mark;
  // dark text on light ground looks thinner than light text on dark ground
  context.font = `${mark.tone === "ink" ? 700 : 500} ${size}px ${FONT}`;
  context.fillStyle = colorOf(mark.tone);
  context.textAlign = align;
  context.textBaseline = "middle";
  const x = rect.x + { left: 0, center: 0.5, right: 1 }[align] * rect.width;
  const measure = (words: string) => context.measureText(words).width;
  const lines = breakLines(mark.text, rect.width, mark.lines, measure);
  const pitch = size * 1.15;
  lines.forEach((line, i) => {
    context.fillText(line, x, rect.y + rect.height / 2 + (i - (lines.length - 1) / 2) * pitch);
  });
}

/**
 * Breaks a text into lines that fit the width, also at each \n. The last of `most` lines ends with
 * an ellipsis if needed.
 */
export function breakLines(
  words: string,
  width: number,
  most: number,
  measure: (words: string) => number,
): readonly string[] {
  const lines: string[] = [];
  const [own, ...others] = words.split("\n");
  if (others.length > 0 && most > 1) {
    const first = breakLines(own, width, most - 1, measure);
    return [...first, ...breakLines(others.join("\n"), width, most - first.length, measure)];
  }
  let rest = words.split(/[ \n]/);
  while (rest.length > 0) {
    if (lines.length === most - 1) return [...lines, shortened(rest.join(" "), width, measure)];
    let count = 1;
    while (count < rest.length && measure(rest.slice(0, count + 1).join(" ")) <= width) count++;
    lines.push(shortened(rest.slice(0, count).join(" "), width, measure));
    rest = rest.slice(count);
  }
  return lines;
}

function shortened(words: string, width: number, measure: (words: string) => number): string {
  if (measure(words) <= width) return words;
  let letters = [...words];
  while (letters.length > 1 && measure(`${letters.join("")}…`) > width) {
    letters = letters.slice(0, -1);
  }
  return `${letters.join("").trimEnd()}…`;
}

function paintTick(context: Context, { x, y, width, height }: Rect, tone: Tone): void {
  context.beginPath();
  context.moveTo(x + 0.25 * width, y + 0.52 * height);
  context.lineTo(x + 0.43 * width, y + 0.7 * height);
  context.lineTo(x + 0.76 * width, y + 0.3 * height);
  context.lineWidth = 6;
  context.strokeStyle = colorOf(tone);
  context.stroke();
}
