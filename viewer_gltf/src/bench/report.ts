/** The report of all runs, as it is saved. Nothing in it tells what the specimen is. Pure. */
import type { FrameTimes } from "./frame_times";

export const MODES = ["mesh", "disc", "all", "traced"] as const;
export type BenchMode = (typeof MODES)[number];
export type Eyes = "mono" | "split" | "headset";

export type Run = FrameTimes &
  Readonly<{
    mode: BenchMode;
    eyes: Eyes;
    /** Longest edge of a tile's volume as it was drawn, voxels; null: no volume shows in the mode. */
    edge: number | null;
    /** Of the frame with most of them. */
    drawCalls: number;
    triangles: number;
    /** Bytes of volumes on the GPU at the end. */
    volumeBytes: number;
  }>;

export type Device = Readonly<{
  /** The graphics driver's name, as far as the browser tells. */
  renderer: string;
  browser: string;
  cores: number;
  /** Of the picture, device pixels. */
  picture_px: readonly [number, number];
}>;

export type Report = Readonly<{
  format: "stereocell-fps";
  version: 1;
  device: Device;
  /** Of each flight, s. */
  flight_s: number;
  /** Most steps of a ray while the picture moves; pixels of the march to one of the picture. */
  steps: number;
  resolution: number;
  tiles: number;
  channels: number;
  runs: readonly Run[];
}>;

export type Line = Readonly<{
  mode: BenchMode;
  eyes: Eyes;
  /** By growing edge; a line of one point without: it holds for all. */
  points: readonly Readonly<{ edge: number | null; fps: number; median_ms: number }>[];
}>;

/** The runs by what they have in common, in the order in which they were made. */
export function linesOf(runs: readonly Run[]): readonly Line[] {
  const found = new Map<string, { line: Omit<Line, "points">; points: Run[] }>();
  for (const run of runs) {
    const key = `${run.mode} ${run.eyes}`;
    const entry = found.get(key) ?? { line: { mode: run.mode, eyes: run.eyes }, points: [] };
    entry.points.push(run);
    found.set(key, entry);
  }
  return [...found.values()].map(({ line, points }) => ({
    ...line,
    points: points
      .map(({ edge, fps, median_ms }) => ({ edge, fps, median_ms }))
      .sort((a, b) => (a.edge ?? 0) - (b.edge ?? 0)),
  }));
}
