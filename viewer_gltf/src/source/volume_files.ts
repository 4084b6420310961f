/**
 * Makes the data of a volume's files: mip levels, the value range of each brick, and counts by value and gradient.
 *
 * Follows pipeline/stereocell/filters/min_max_bricks.py and transfer/joint_histogram.py.
 */
import { SKIP_BRICK } from "../bundle/generated/constants";
import type { Size3 } from "../bundle/ktx2";
import { COLUMNS, ROWS } from "../bundle/transfer_2d";
import { brickCounts } from "../voxels/skip_bricks";

/** 8-bit texels, x fastest. */
export type Texels = Readonly<{ size: Size3; data: Uint8Array }>;

/** Largest number of texels along the longest axis of the last mip level. */
const SMALLEST_LEVEL = 4;
/** Approximate number of voxels whose gradients are counted; in a larger volume, planes are skipped at regular steps. */
const COUNTED_VOXELS = 4_000_000;

/** Returns values as 8-bit texels; the ends of the window become 0 and 255. */
export function toTexels(values: Float32Array, [low, high]: readonly [number, number]): Uint8Array {
  const scale = 255 / (high - low);
  const texels = new Uint8Array(values.length);
  for (let i = 0; i < values.length; i++) {
    texels[i] = Math.min(255, Math.max(0, (values[i] - low) * scale)) + 0.5;
  }
  return texels;
}

/**
 * Returns the volume and its coarser mip levels, finest first. Each level is made from unrounded
 * means, then rounded.
 */
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

/** Halves the voxels along an axis. A coarser voxel is the mean of those it covers, weighted by the covered share. */
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

/** Returns the smallest and largest texel of each brick, interleaved. One texel more on each side counts, too. */
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
 * Counts voxels by value and gradient magnitude: ROWS x COLUMNS, row 0 is gradient 0. The outermost voxels, an apron,
 * are used for gradients and not counted.
 *
 * @param spacing x, y, z; only its ratios matter
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

/** Returns counts on a logarithmic scale: 0 for no voxels, 255 for the largest count, `most`. */
export function logScaled(counts: Float64Array, most: number): Uint8Array {
  const scale = most === 0 ? 0 : 255 / Math.log1p(most);
  return Uint8Array.from(counts, (n) =>
    n === 0 ? 0 : Math.max(1, Math.round(scale * Math.log1p(n))),
  );
}
