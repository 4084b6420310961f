/** Draws a chart on a canvas: frames per second by the size of volumes, with a line for each mode. */
import { type Line, linesOf, type Report } from "./report";

const WIDTH = 960;
const HEIGHT = 540;
const PLOT = { left: 70, right: 250, top: 64, bottom: 64 } as const;
/** Okabe & Ito, "Color Universal Design", 2008. */
const COLORS = { mesh: "#cc79a7", disc: "#e69f00", all: "#56b4e9", traced: "#009e73" } as const;
const NAMES = { mesh: "surfaces", disc: "disc", all: "all volumes", traced: "paths of light" };
const EYES = { mono: "one picture", split: "split screen", headset: "headset" } as const;
const INK = "#dfe3ee";
const DIM = "#8b93a7";

/** Frame rates of displays, and lower ones, for the chart's axis. */
const RATES = [1, 2, 5, 10, 15, 30, 60, 72, 90, 120, 240];

export function drawChart(canvas: HTMLCanvasElement, report: Report): void {
  canvas.width = WIDTH;
  canvas.height = HEIGHT;
  const pen = canvas.getContext("2d");
  if (pen === null) return;
  const lines = linesOf(report.runs);
  const edges = [...new Set(report.runs.flatMap(({ edge }) => edge ?? []))].sort((a, b) => a - b);
  const [low, high] = range(lines);
  const right = WIDTH - PLOT.right;
  const xOf = (edge: number) => {
    const [first, last] = [Math.log2(edges[0]), Math.log2(edges[edges.length - 1])];
    const share = last > first ? (Math.log2(edge) - first) / (last - first) : 0.5;
    return PLOT.left + 20 + share * (right - PLOT.left - 40);
  };
  const yOf = (fps: number) => {
    const share = (Math.log(fps) - Math.log(low)) / (Math.log(high) - Math.log(low));
    return HEIGHT - PLOT.bottom - share * (HEIGHT - PLOT.bottom - PLOT.top);
  };
  pen.fillStyle = "#0b0d12";
  pen.fillRect(0, 0, WIDTH, HEIGHT);
  pen.font = "600 16px system-ui, sans-serif";
  pen.fillStyle = INK;
  pen.fillText("Frames per second by volume size", PLOT.left, 28);
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = DIM;
  const { renderer, picture_px } = report.device;
  pen.fillText(`${renderer}, ${picture_px.join(" × ")} pixels`.slice(0, 130), PLOT.left, 48);
  pen.lineWidth = 1;
  for (const rate of RATES.filter((each) => each >= low && each <= high)) {
    pen.strokeStyle = "#232838";
    stroke(pen, [
      [PLOT.left, yOf(rate)],
      [right, yOf(rate)],
    ]);
    pen.textAlign = "right";
    pen.fillText(String(rate), PLOT.left - 8, yOf(rate) + 4);
  }
  pen.textAlign = "center";
  for (const edge of edges) pen.fillText(`${edge}³`, xOf(edge), HEIGHT - PLOT.bottom + 22);
  pen.fillText("voxels of a tile's volume", (PLOT.left + right) / 2, HEIGHT - 18);
  pen.textAlign = "left";
  lines.forEach((line, i) => {
    drawLine(pen, line, xOf, yOf, [PLOT.left, right]);
    const y = PLOT.top + 22 * i;
    style(pen, line);
    stroke(pen, [
      [right + 24, y],
      [right + 54, y],
    ]);
    pen.setLineDash([]);
    pen.fillStyle = INK;
    pen.fillText(`${NAMES[line.mode]}, ${EYES[line.eyes]}`, right + 62, y + 4);
  });
}

type Pen = CanvasRenderingContext2D;
type At = readonly [number, number];

function range(lines: readonly Line[]): readonly [number, number] {
  const all = lines.flatMap(({ points }) => points.map(({ fps }) => fps));
  const low = Math.min(...all, 60);
  const high = Math.max(...all, 60);
  return [low / 1.5, high * 1.5];
}

function style(pen: Pen, { mode, eyes }: Line): void {
  pen.strokeStyle = COLORS[mode];
  pen.fillStyle = COLORS[mode];
  pen.lineWidth = 2.5;
  pen.setLineDash(eyes === "mono" ? [] : [7, 5]);
}

function drawLine(
  pen: Pen,
  line: Line,
  xOf: (edge: number) => number,
  yOf: (fps: number) => number,
  [left, right]: At,
): void {
  style(pen, line);
  const at = line.points.flatMap(({ edge, fps }): At[] =>
    edge === null
      ? [
          [left, yOf(fps)],
          [right, yOf(fps)],
        ]
      : [[xOf(edge), yOf(fps)]],
  );
  stroke(pen, at);
  pen.setLineDash([]);
  if (line.points.some(({ edge }) => edge === null)) return;
  for (const [x, y] of at) {
    pen.beginPath();
    pen.arc(x, y, 4, 0, 2 * Math.PI);
    pen.fill();
  }
}

function stroke(pen: Pen, points: readonly At[]): void {
  pen.beginPath();
  points.forEach(([x, y], i) => {
    if (i === 0) pen.moveTo(x, y);
    else pen.lineTo(x, y);
  });
  pen.stroke();
}
