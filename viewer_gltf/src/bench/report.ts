/** The report of all runs in the form that is saved. It contains nothing that identifies the specimen. Pure. */
import type { FrameTimes } from "./frame_times";

export const MODES = ["mesh", "disc", "all", "traced"] as const;
export type BenchMode = (typeof MODES)[number];
export type Eyes = "mono" | "split" | "headset";

export type Run = FrameTimes &
  Readonly<{
    mode: BenchMode;
    eyes: Eyes;
    /** Longest edge of a tile's volume as it was drawn, voxels; null if the mode shows no volumes. */
    edge: number | null;
    /** Largest number of draw calls of a frame. */
    drawCalls: number;
    triangles: number;
    /** Bytes of volumes on the GPU at the end. */
    volumeBytes: number;
  }>;

export type Device = Readonly<{
  /** The graphics driver's name, if the browser states it. */
  renderer: string;
  browser: string;
  cores: number;
  /** Width and height of the view, device pixels. */
  picture_px: readonly [number, number];
}>;

export type Report = Readonly<{
  format: "stereocell-fps";
  version: 1;
  device: Device;
  /** Length of each flight, s. */
  flight_s: number;
  /** Largest number of steps of a ray while the view moves; `resolution`: marched pixels for each pixel of the view. */
  steps: number;
  resolution: number;
  tiles: number;
  channels: number;
  runs: readonly Run[];
}>;

export type Line = Readonly<{
  mode: BenchMode;
  eyes: Eyes;
  /** Points by ascending edge. The edge is null in a line of one point, which holds for all sizes of volumes. */
  points: readonly Readonly<{ edge: number | null; fps: number; median_ms: number }>[];
}>;

/** Groups the runs by mode and kind of stereo, in the order in which they were made. */
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
