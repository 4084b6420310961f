/**
 * The grey values of an MR on its cut faces, as a slice shows them: a two-dimensional function of bands of values.
 *
 * Follows pipeline/stereocell/transfer/mr_grey.py, which explains the method and defines the numbers.
 */
import {
  BANDS,
  BRIGHT_SHARE,
  DARKEST,
  EDGE_FROM,
  EDGE_SOFTNESS,
  LEAST_RANGE,
  STEEP,
  STEEPEST,
} from "../bundle/generated/grey_shapes";
import type { Shape } from "../bundle/generated/transfer2d";
import { BINS } from "./find_window";
import type { OpacityPoints } from "./opacity";

export const GREY = "grey";

/**
 * @param level intensity at which the specimen begins, as a share 0..1 of the window
 * @param opacity of the general function
 * @param gradientMax size of a step whose gradient counts as 1, as a share of the window
 */
export function greyShapes(
  level: number,
  histogram: Float64Array,
  opacity: OpacityPoints,
  gradientMax: number,
): Shape[] {
  const foot = opacity.filter(([, absorbed]) => absorbed === 0).at(-1)?.[0] ?? 0;
  const step = (Math.max(brightestOf(level, histogram), foot + LEAST_RANGE) - foot) / BANDS;
  return Array.from({ length: BANDS }, (_, band) => {
    const middle = foot + (band + 0.5) * step;
    const light = DARKEST + ((1 - DARKEST) * (band + 0.5)) / BANDS;
    const isLast = band === BANDS - 1;
    const values: Shape["values"] = [
      Math.max(middle - step, foot),
      isLast ? 1 : Math.min(middle + step, 1),
    ];
    const share = opacityAt(opacity, middle);
    const steep = (STEEP * middle) / gradientMax;
    const hasEdge = steep < STEEPEST && !isLast;
    const shape = shapeOf(values, [0, hasEdge ? steep : 1], light, share);
    if (!hasEdge) return [shape];
    const edge = shapeOf(values, [EDGE_FROM * steep, 1], 1, share);
    return [shape, { ...edge, softness: EDGE_SOFTNESS }];
  }).flat();
}

/** Returns the value from which tissue has the channel's full colour, 0..1 in the window. */
function brightestOf(level: number, histogram: Float64Array): number {
  const within = histogram.subarray(Math.floor(level * BINS));
  const total = within.reduce((sum, n) => sum + n, 0);
  let below = 0;
  const bin = within.findIndex((n) => {
    below += n;
    return below >= BRIGHT_SHARE * total;
  });
  return Math.min(level + Math.max(0, bin) / BINS, 1);
}

function opacityAt(points: OpacityPoints, value: number): number {
  const after = points.findIndex(([x]) => x >= value);
  if (after <= 0) return points[after === 0 ? 0 : points.length - 1][1];
  const [[x0, y0], [x1, y1]] = [points[after - 1], points[after]];
  return y0 + ((y1 - y0) * (value - x0)) / (x1 - x0);
}

function shapeOf(
  values: Shape["values"],
  gradients: Shape["gradients"],
  light: number,
  opacity: number,
): Shape {
  return {
    ...{ kind: "rectangle", values, gradients, tip: 0.5, color: [light, light, light] },
    ...{ opacity, softness: 1 },
  };
}
