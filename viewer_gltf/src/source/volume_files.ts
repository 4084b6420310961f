/**
 * The data of a volume's files: mip levels, the value range of each brick, and counts by value and gradient.
 *
 * Follows pipeline/stereocell/filters/min_max_bricks.py and transfer/joint_histogram.py.
 */
import { SKIP_BRICK } from "../bundle/generated/constants";
import type { Size3 } from "../bundle/ktx2";
import { COLUMNS, ROWS } from "../bundle/transfer_2d";
import { brickCounts } from "../voxels/skip_bricks";

/** 8-bit texels, x fastest. */
export type Texels = Readonly<{ size: Size3; data: Uint8Array }>;

/** Texels along the longest axis of the last mip level, at most. */
const SMALLEST_LEVEL = 4;
/** Most voxels whose gradients are counted; of a larger volume every so many planes are. */
const COUNTED_VOXELS = 4_000_000;

/** Values as 8-bit texels: the ends of the window are 0 and 255. */
export function toTexels(values: Float32Array, [low, high]: readonly [number, number]): Uint8Array {
  const scale = 255 / (high - low);
  const texels = new Uint8Array(values.length);
  for (let i = 0; i < values.length; i++) {
    texels[i] = Math.min(255, Math.max(0, (values[i] - low) * scale)) + 0.5;
  }
  return texels;
}

/** The volume and its coarser levels, finest first. Means are kept between levels, and rounded at each. */
export function mipLevels(volume: Texels): readonly Texels[] {
  const levels = [volume];
  let means = new Float32Array(volume.data);
  let size = volume.size;
  while (Math.max(...size) > SMALLEST_LEVEL) {
    for (const axis of [0, 1, 2] as const) {
      means = halve(means, size, axis);
      size = size.map((n, i) => (i === axis ? Math.max(1, n >> 1) : n)) as unknown as Size3;
    }
    levels.push({ size, data: rounded(means) });
  }
  return levels;
}

function rounded(values: Float32Array): Uint8Array {
  const texels = new Uint8Array(values.length);
  for (let i = 0; i < values.length; i++) texels[i] = values[i] + 0.5;
  return texels;
}

/** Half as many along an axis: a coarser voxel is the mean of those that it covers, by the share that it covers. */
function halve(
  values: Float32Array<ArrayBuffer>,
  size: Size3,
  axis: 0 | 1 | 2,
): Float32Array<ArrayBuffer> {
  const n = size[axis];
  const m = n >> 1;
  if (m === 0) return values;
  const inner = size.slice(0, axis).reduce((product, one) => product * one, 1);
  const outer = size.slice(axis + 1).reduce((product, one) => product * one, 1);
  const made = new Float32Array(inner * m * outer);
  const isEven = n === 2 * m;
  for (let o = 0; o < outer; o++) {
    for (let i = 0; i < m; i++) {
      const from = (o * n + 2 * i) * inner;
      const to = (o * m + i) * inner;
      const [a, b, c] = isEven ? [0.5, 0.5, 0] : [(m - i) / n, m / n, (i + 1) / n];
      for (let k = 0; k < inner; k++) {
        const at = from + k;
        const third = isEven ? 0 : c * values[at + 2 * inner];
        made[to + k] = a * values[at] + b * values[at + inner] + third;
      }
    }
  }
  return made;
}

/** Smallest and largest texel of each brick and of one more on each side, interleaved. */
export function minMaxBricks({ size, data }: Texels): Texels {
  let [low, high] = [data, data];
  let shape = size;
  const counts = brickCounts(size);
  for (const axis of [0, 1, 2] as const) {
    low = reduceBricks(low, shape, axis, counts[axis], Math.min);
    high = reduceBricks(high, shape, axis, counts[axis], Math.max);
    shape = shape.map((n, i) => (i === axis ? counts[axis] : n)) as unknown as Size3;
  }
  const both = new Uint8Array(2 * low.length);
  for (let i = 0; i < low.length; i++) {
    both[2 * i] = low[i];
    both[2 * i + 1] = high[i];
  }
  return { size: counts, data: both };
}

function reduceBricks(
  values: Uint8Array,
  size: Size3,
  axis: 0 | 1 | 2,
  count: number,
  pick: (a: number, b: number) => number,
): Uint8Array {
  const n = size[axis];
  const inner = size.slice(0, axis).reduce((product, one) => product * one, 1);
  const outer = size.slice(axis + 1).reduce((product, one) => product * one, 1);
  const made = new Uint8Array(inner * count * outer);
  for (let o = 0; o < outer; o++) {
    for (let brick = 0; brick < count; brick++) {
      const first = Math.max(0, SKIP_BRICK * brick - 1);
      const last = Math.min(n - 1, SKIP_BRICK * (brick + 1));
      const to = (o * count + brick) * inner;
      for (let k = 0; k < inner; k++) {
        let found = values[(o * n + first) * inner + k];
        for (let i = first + 1; i <= last; i++) {
          found = pick(found, values[(o * n + i) * inner + k]);
        }
        made[to + k] = found;
      }
    }
  }
  return made;
}

/**
 * Voxels by value and gradient magnitude: ROWS x COLUMNS, row 0 is gradient 0. The outermost voxels, an apron, are
 * counted only as neighbours.
 *
 * @param spacing x, y, z; only its ratios count
 */
export function countJoint(
  { size, data }: Texels,
  spacing: Size3,
  gradientMax: number,
): Float64Array {
  const [width, height, depth] = size;
  const counts = new Float64Array(ROWS * COLUMNS);
  const every = Math.ceil(data.length / COUNTED_VOXELS);
  const finest = Math.min(...spacing);
  const [fx, fy, fz] = spacing.map((step) => finest / step);
  const row = (ROWS - 1) / (255 * gradientMax);
  const plane = width * height;
  for (let z = 1; z < depth - 1; z += every) {
    for (let y = 1; y < height - 1; y++) {
      for (let x = 1; x < width - 1; x++) {
        const at = (z * height + y) * width + x;
        const dx = (data[at + 1] - data[at - 1]) * fx;
        const dy = (data[at + width] - data[at - width]) * fy;
        const dz = (data[at + plane] - data[at - plane]) * fz;
        const step = Math.sqrt(dx * dx + dy * dy + dz * dz);
        counts[Math.floor(Math.min(step * row + 0.5, ROWS - 1)) * COLUMNS + data[at]]++;
      }
    }
  }
  return counts;
}

/** Counts as a picture on a logarithmic scale: 0 where there is none, 255 where there are most. */
export function logScaled(counts: Float64Array, most: number): Uint8Array {
  const scale = most === 0 ? 0 : 255 / Math.log1p(most);
  return Uint8Array.from(counts, (n) =>
    n === 0 ? 0 : Math.max(1, Math.round(scale * Math.log1p(n))),
  );
}
