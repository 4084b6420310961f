/** Makes all runs of a benchmark one after another: each mode, with and without stereo, for each size of volumes. */
import type { Vec3 } from "../math/vec3";
import { type FlightPose, poseAt } from "./flight";
import { summarise } from "./frame_times";
import { type BenchMode, type Device, type Eyes, MODES, type Report, type Run } from "./report";

/** The viewer that is measured. */
export type Subject = Readonly<{
  device: Device;
  tiles: number;
  channels: number;
  canTrace: boolean;
  /** Longest edges of a tile's volume at each of its mip levels, voxels, in ascending order. */
  edges: () => Promise<readonly number[]>;
  /** Limits volumes from now on to mip levels of at most `edge` voxels along an edge. */
  limit: (edge: number) => void;
  show: (mode: BenchMode) => void;
  /** Resolves once everything that is shown has loaded. */
  settled: () => Promise<void>;
  /** Returns the position of the eyes, and the specimen's centre at the start of a flight, m. */
  stand: () => Readonly<{ eye: Vec3; middle: Vec3 }>;
  fly: (pose: FlightPose) => void;
  /** Resolves when the next frame has been drawn. */
  nextFrame: () => Promise<void>;
  /** Returns the cost of the previous frame. */
  cost: () => Readonly<{ drawCalls: number; triangles: number; volumeBytes: number }>;
  settings: () => Readonly<{ steps: number; resolution: number }>;
  /** Leaves stereo, so that the view is flat again. */
  endStereo: () => Promise<void>;
}>;

/** Smallest edge of volumes that are measured, voxels; users do not look at smaller ones. */
const MIN_EDGE = 32;
/** Number of frames that are drawn before those that count, since the first one compiles shaders. */
const WARM_UP_FRAMES = 3;
/** Smallest number of frames of a flight, even if frames take long. */
const MIN_FRAMES = 6;

/** The announcement before each run: its number, the number of all runs, and its settings. */
export type Step = Readonly<{ index: number; count: number; mode: BenchMode; eyes: Eyes }> &
  Readonly<{ edge: number | null }>;

/**
 * Makes all runs, and returns their report.
 *
 * @param stereo the kind of stereo that is on when the first run begins; null if stereo is not measured
 * @param flight_s length of each run, s
 */
export async function runAll(
  subject: Subject,
  stereo: "split" | "headset" | null,
  flight_s: number,
  onStep: (step: Step) => void,
): Promise<Report> {
  const all = await subject.edges();
  const large = all.filter((edge) => edge >= MIN_EDGE);
  const edges = large.length > 0 ? large : all.slice(-1);
  const modes = MODES.filter((mode) => mode !== "traced" || subject.canTrace);
  // Stereo is measured first, since a page may start it only for a moment after a tap.
  const eyes: readonly Eyes[] = stereo === null ? ["mono"] : [stereo, "mono"];
  const steps = eyes.flatMap((each) =>
    modes.flatMap((mode) =>
      (mode === "mesh" ? [null] : edges).map((edge) => ({ mode, eyes: each, edge })),
    ),
  );
  const runs: Run[] = [];
  for (const [index, step] of steps.entries()) {
    onStep({ ...step, index, count: steps.length });
    if (step.eyes === "mono") await subject.endStereo();
    const run = await runOne(subject, step, flight_s);
    if (run !== null) runs.push(run);
  }
  const { device, tiles, channels } = subject;
  const { steps: most, resolution } = subject.settings();
  return {
    format: "stereocell-fps",
    version: 1,
    device,
    flight_s,
    steps: most,
    resolution,
    tiles,
    channels,
    runs,
  };
}

async function runOne(
  subject: Subject,
  { mode, eyes, edge }: Pick<Run, "mode" | "eyes" | "edge">,
  flight_s: number,
): Promise<Run | null> {
  if (edge !== null) subject.limit(edge);
  subject.show(mode);
  const { eye, middle } = subject.stand();
  subject.fly(poseAt(0, eye, middle));
  await subject.settled();
  for (let i = 0; i < WARM_UP_FRAMES; i++) {
    subject.fly(poseAt(0, eye, middle));
    await subject.nextFrame();
  }
  const drawnAt_ms = [performance.now()];
  let [drawCalls, triangles] = [0, 0];
  for (let share = 0; share < 1 || drawnAt_ms.length <= MIN_FRAMES; ) {
    subject.fly(poseAt(share, eye, middle));
    await subject.nextFrame();
    const now = performance.now();
    drawnAt_ms.push(now);
    share = (now - drawnAt_ms[0]) / (1000 * flight_s);
    const cost = subject.cost();
    drawCalls = Math.max(drawCalls, cost.drawCalls);
    triangles = Math.max(triangles, cost.triangles);
  }
  const times = summarise(drawnAt_ms);
  const { volumeBytes } = subject.cost();
  return times && { mode, eyes, edge, ...times, drawCalls, triangles, volumeBytes };
}
