/** All runs of a benchmark, one after another: each mode in each kind of picture, by volume size. */
import type { Vec3 } from "../math/vec3";
import { type FlightPose, poseAt } from "./flight";
import { summarise } from "./frame_times";
import { type BenchMode, type Device, type Eyes, MODES, type Report, type Run } from "./report";

/** What a run is done to. */
export type Subject = Readonly<{
  device: Device;
  tiles: number;
  channels: number;
  canTrace: boolean;
  /** Longest edges of a tile's volume at each of its mip levels, voxels, by size. */
  edges: () => Promise<readonly number[]>;
  /** Draw volumes of at most so many voxels along an edge, from now on. */
  limit: (edge: number) => void;
  show: (mode: BenchMode) => void;
  /** Resolves once all that is shown has come. */
  settled: () => Promise<void>;
  /** Where the eyes are, and the middle of the specimen as it opens, m. */
  stand: () => Readonly<{ eye: Vec3; middle: Vec3 }>;
  fly: (pose: FlightPose) => void;
  /** Resolves when the next frame has been drawn. */
  nextFrame: () => Promise<void>;
  /** Of the frame before. */
  cost: () => Readonly<{ drawCalls: number; triangles: number; volumeBytes: number }>;
  settings: () => Readonly<{ steps: number; resolution: number }>;
  /** Back to one flat picture. */
  endStereo: () => Promise<void>;
}>;

/** Volumes of fewer voxels along an edge are no volumes that anyone looks at. */
const MIN_EDGE = 32;
/** Frames before those that count: shaders are compiled at the first. */
const WARM_UP_FRAMES = 3;
/** Where frames take long, a flight takes so many nevertheless. */
const MIN_FRAMES = 6;

/** What is announced before each run: which of how many, and what it is. */
export type Step = Readonly<{ index: number; count: number; mode: BenchMode; eyes: Eyes }> &
  Readonly<{ edge: number | null }>;

/**
 * @param stereo the kind that the viewer is in as the first run begins; null: no stereo is measured
 * @param flight_s of each run, s
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
  // a tap lets a page into stereo for a moment only: so stereo is first
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
