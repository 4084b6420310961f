/**
 * Makes transfer functions from intensity to opacity.
 *
 * Follows `make_transfer_functions` of pipeline/stereocell/transfer/opacity.py, which explains the
 * method and defines the numbers. The level (the intensity at which the specimen begins) differs: a
 * build uses the iso-value of a surface. This page uses the intensity of find_level.ts, or that of
 * the skin for a CT. The page makes no functions at the adaptive threshold or for the tissues of a
 * CT, and no two-dimensional ones except those of grey_shapes.ts.
 */
import {
  AT_SURFACE,
  AT_SURFACE_OF_MAGNITUDES,
  BELOW_BODY,
  BRIGHT,
  BRIGHT_OF_MAGNITUDES,
  FAINT,
  FOOT,
  IN_BODY,
  LEAST_SHARE,
  MAX_SHIFT,
  NEAR_SURFACE,
  NOISE_REACH,
  SOFT_DEPTH,
  SOLID_BODY,
} from "../bundle/generated/opacity";
import { BINS } from "./find_window";

/** Intensity and opacity, 0..1 each. */
export type OpacityPoints = readonly (readonly [number, number])[];

/**
 * Percent of the voxels that are too faint to show in a channel in which no intensity is known at
 * which objects begin.
 */
const LEVEL_PERCENTILE = 99;

export type FunctionOptions = Readonly<{
  /** Intensity at which the specimen begins, as a share 0..1 of the window; null if unknown. */
  level: number | null;
  /** The DICOM modality; empty for a microscope. */
  modality: "" | "CT" | "MR";
  /** Shortest edge of the volume, in finest voxel spacings. */
  depth_voxels: number;
}>;

/** Intensities at which opacity leaves 0, reaches its value at a surface, and reaches its value in a bright object. */
type Rise = Readonly<{ floor: number; top: number; bright: number }>;

/**
 * Returns the opacity points of each function, by name.
 *
 * @param histogram voxel counts over 0..1 in BINS equal bins
 */
export function makeFunctions(
  histogram: Float64Array,
  options: FunctionOptions,
): ReadonlyMap<string, OpacityPoints> {
  const { modality, depth_voxels } = options;
  const found = options.level ?? quantile(histogram, LEVEL_PERCENTILE / 100);
  const level = Math.min(0.96, Math.max(0.02, found));
  const hasLevel = options.level !== null;
  const { floor, top, bright } =
    modality === "CT" && hasLevel
      ? riseOfBody(level)
      : riseOf(level, histogram, hasLevel, modality === "MR");
  const start = modality === "MR" ? AT_SURFACE_OF_MAGNITUDES : AT_SURFACE;
  const atTop = start + ((IN_BODY - start) * (top - level)) / (bright - level);
  const soft = pointsOf([floor, 0], [top, 0.04], [1, 0.2]);
  return new Map<string, OpacityPoints>([
    ["default", pointsOf([floor, 0], [top, atTop], [bright, IN_BODY], [1, 0.6])],
    ["soft", thinned(soft, histogram, depth_voxels)],
    ["sharp", pointsOf([0.97 * level, 0], [Math.min(1.03 * level, 0.99), 0.8], [1, 0.9])],
    [
      "surface",
      pointsOf([0.85 * level, 0], [level, 0.5], [Math.min(1.15 * level, 0.99), 0], [1, 0]),
    ],
  ]);
}

function riseOfBody(level: number): Rise {
  const floor = Math.max(level - BELOW_BODY, 0.5 * level);
  return { floor, top: level, bright: Math.min(level + SOLID_BODY, 0.99) };
}

function riseOf(
  level: number,
  histogram: Float64Array,
  hasLevel: boolean,
  areMagnitudes: boolean,
): Rise {
  const median = quantile(histogram, 0.5);
  const way = hasLevel ? NEAR_SURFACE : 0.5;
  let floor = Math.min(Math.max(median + way * (level - median), way * level), 0.9 * level);
  const isNoisy = areMagnitudes && hasLevel;
  const share = isNoisy ? BRIGHT_OF_MAGNITUDES : BRIGHT;
  const bright = Math.max(level + share * (1 - level), level + 0.02);
  if (isNoisy) {
    // Noise of an MR's magnitudes would look like dust in front of a surface. Opacity starts where the noise ends.
    const below = smoothed(histogram.subarray(0, Math.floor(level * BINS)));
    floor = Math.max(floor, Math.min(endOfNoise(below) / BINS, FOOT * level));
    const beyond = level + noiseBeyond(below) / BINS;
    if (beyond > level) floor = Math.min(beyond, MAX_SHIFT * level, (FOOT * (level + bright)) / 2);
  }
  return { floor, top: Math.max(level, floor / FOOT), bright };
}

/** Returns the bin at which the noise of the background ends; 0 if the background has no peak. */
function endOfNoise(below: Float64Array): number {
  const mode = below.indexOf(Math.max(0, ...below));
  if (mode === -1 || below[mode] === 0) return 0;
  const half = below.subarray(mode).findIndex((height) => height <= below[mode] / 2);
  return half === -1 ? 0 : mode + NOISE_REACH * half;
}

/** Returns by how many bins noise extends beyond the level; 0 if the counts there are few or do not fall. */
function noiseBeyond(below: Float64Array): number {
  const last = below.length - 1;
  const before = Math.floor(0.75 * last);
  const peak = Math.max(0, ...below);
  if (last < 4 || peak === 0 || below[last] <= FAINT * peak) return 0;
  if (below.indexOf(peak) >= before) return 0;
  const fall = Math.log(below[before] / below[last]);
  if (fall < 1) return 0;
  return (Math.log(below[last] / (FAINT * peak)) * (last - before)) / fall;
}

/** Smooths counts by a Gaussian of 2 bins, like SciPy's `gaussian_filter1d` in mode `nearest`. */
function smoothed(counts: Float64Array): Float64Array {
  const [sigma, reach] = [2, 8];
  const weights = Array.from({ length: 2 * reach + 1 }, (_, i) =>
    Math.exp(-((i - reach) ** 2) / (2 * sigma * sigma)),
  );
  const total = weights.reduce((sum, weight) => sum + weight, 0);
  return counts.map((_, bin) => {
    let sum = 0;
    for (const [i, weight] of weights.entries()) {
      const at = Math.min(counts.length - 1, Math.max(0, bin + i - reach));
      sum += weight * counts[at];
    }
    return sum / total;
  });
}

/** Returns the intensity, 0..1, below which a share of the voxels lies: the upper end of a bin. */
function quantile(histogram: Float64Array, share: number): number {
  const total = Math.max(1, sumOf(histogram));
  let below = 0;
  for (let bin = 0; bin < histogram.length; bin++) {
    below += histogram[bin];
    if (below / total >= share) return (bin + 1) / histogram.length;
  }
  return 1;
}

const sumOf = (counts: Float64Array) => counts.reduce((sum, n) => sum + n, 0);

/** Returns the points with opacities that are reduced until the volume's mean optical depth is about SOFT_DEPTH. */
function thinned(
  soft: OpacityPoints,
  histogram: Float64Array,
  depth_voxels: number,
): OpacityPoints {
  const opacities = evaluate(soft);
  const absorbed = histogram.reduce((sum, n, i) => sum - n * Math.log1p(-opacities[i]), 0);
  const depth = (depth_voxels * absorbed) / Math.max(1, sumOf(histogram));
  if (depth <= SOFT_DEPTH) return soft;
  const share = Math.max(LEAST_SHARE, SOFT_DEPTH / depth);
  return pointsOf(...soft.slice(1).map(([x, opacity]) => [x, 1 - (1 - opacity) ** share] as const));
}

/** Returns the opacity at BINS intensities from 0 to 1, linear between the points. */
export function evaluate(points: OpacityPoints): Float32Array {
  const table = new Float32Array(BINS);
  let segment = 0;
  for (let i = 0; i < BINS; i++) {
    const x = i / (BINS - 1);
    while (segment < points.length - 2 && points[segment + 1][0] < x) segment++;
    const [[x0, y0], [x1, y1]] = [points[segment], points[segment + 1]];
    const share = x1 > x0 ? Math.min(1, Math.max(0, (x - x0) / (x1 - x0))) : 1;
    table[i] = y0 + share * (y1 - y0);
  }
  return table;
}

/** Returns the origin and the given points, rounded like those of a build. */
function pointsOf(...inner: (readonly [number, number])[]): OpacityPoints {
  const round = (value: number) => Math.round(value * 1e4) / 1e4;
  return [[0, 0], ...inner.map(([x, opacity]) => [round(x), round(opacity)] as const)];
}
