/**
 * Reduces a channel to the means of blocks of its voxels, so that it fits into a page however large the source is.
 *
 * Follows pipeline/stereocell/live/coarse_channel.py, which reads blocks of a finer level where the source has one. The
 * page has to fetch all voxels that it reads. It takes one level as it is, and blocks only if the coarsest level is too
 * large.
 */
import { SourceError } from "./source_error";

/** Three numbers of a volume: along z, y and x. */
export type Triple = readonly [number, number, number];

/** Largest number of shown voxels of all channels together; 8 MB of textures. */
export const SHOWN_VOXELS = 8_000_000;
/**
 * Largest number of voxels that are read for each shown voxel, at the coarsest (or only) resolution
 * level of a source.
 */
export const READ_FACTOR = 8;
/** Approximate number of values on which a window is found. The pipeline takes 6 million. */
const SAMPLED_VOXELS = 500_000;

/** Voxels as they are stored: any order of axes, in either direction. */
export type StoredVoxels = Readonly<{
  data: ArrayLike<number>;
  shape: Triple;
  /** Index of voxel (0, 0, 0), and steps of the index along each axis. */
  offset: number;
  strides: Triple;
  /** A voxel's value is slope * stored + intercept. */
  slope: number;
  intercept: number;
}>;

export type CoarseVolume = Readonly<{
  /** Values of the averaged voxels, x fastest. */
  voxels: Float32Array<ArrayBuffer>;
  shape: Triple;
  /** Centre of voxel (0, 0, 0), in voxels of the finest level. */
  first: Triple;
  /** Distance between voxels, in voxels of the finest level. */
  step: Triple;
  /** Values as they were read, before averaging; histograms are made from these. */
  sample: Float32Array<ArrayBuffer>;
}>;

/**
 * Where the voxels of a resolution level lie: the centre of its first voxel and the distance
 * between voxels (z, y, x), both in voxels of the finest level.
 */
export type LevelPlace = Readonly<{ first: Triple; step: Triple }>;

export const volumeOf = ([z, y, x]: Triple) => z * y * x;

export const triple = (make: (axis: 0 | 1 | 2) => number): Triple => [make(0), make(1), make(2)];

/** Returns the edges of a block in voxels, about equal in length, such that at most `most` blocks fill the shape. */
export function blockFor(shape: Triple, spacing: Triple, most: number): Triple {
  let edge = (shape.reduce((product, n, i) => product * n * spacing[i], 1) / most) ** (1 / 3);
  for (;;) {
    const block = triple((i) =>
      Math.min(Math.max(1, Math.round(edge / spacing[i])), Math.max(1, shape[i])),
    );
    if (volumeOf(triple((i) => Math.floor(shape[i] / block[i]))) <= most) return block;
    edge *= 1.05;
  }
}

/** Throws SourceError where no voxel is a finite number. */
export function makeCoarse(
  stored: StoredVoxels,
  block: Triple,
  place: LevelPlace,
  where: string,
): CoarseVolume {
  const shape = triple((i) => Math.floor(stored.shape[i] / block[i]));
  const voxels = blockMeans(stored, block, shape);
  const sample = sampleOf(stored);
  const least = leastOf(sample);
  if (least === null) {
    throw new SourceError(`${where}: all voxels are NaN or infinite, expected finite numbers.`);
  }
  // Values that are not finite become the smallest one, as in the readers of the pipeline.
  for (const values of [voxels, sample]) {
    for (let i = 0; i < values.length; i++) if (!Number.isFinite(values[i])) values[i] = least;
  }
  return {
    ...{ voxels, shape, sample },
    first: triple((i) => place.first[i] + ((block[i] - 1) / 2) * place.step[i]),
    step: triple((i) => block[i] * place.step[i]),
  };
}

function blockMeans({ data, ...stored }: StoredVoxels, block: Triple, shape: Triple) {
  const { offset, strides, slope, intercept } = stored;
  const [depth, height, width] = shape;
  const [sz, sy, sx] = strides;
  const [bz, by, bx] = block;
  const voxels = new Float32Array(volumeOf(shape));
  const scale = slope / volumeOf(block);
  let at = 0;
  for (let z = 0; z < depth; z++) {
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < width; x++) {
        const first = offset + z * bz * sz + y * by * sy + x * bx * sx;
        let sum = 0;
        for (let k = 0; k < bz; k++) {
          for (let j = 0; j < by; j++) {
            for (let i = 0; i < bx; i++) sum += data[first + k * sz + j * sy + i * sx];
          }
        }
        voxels[at++] = scale * sum + intercept;
      }
    }
  }
  return voxels;
}

/** Returns values of voxels that are spread evenly over the volume, in the order in which they are stored. */
function sampleOf({ data, shape, slope, intercept }: StoredVoxels): Float32Array<ArrayBuffer> {
  const count = Math.min(data.length, volumeOf(shape));
  let every = Math.ceil(count / SAMPLED_VOXELS);
  if (every > 1 && every % 2 === 0) every++; // an odd step does not pick the same columns in each row of an even length
  const sample = new Float32Array(Math.ceil(count / every));
  for (let i = 0; i < sample.length; i++) sample[i] = slope * data[i * every] + intercept;
  return sample;
}

function leastOf(values: Float32Array): number | null {
  let least = Number.POSITIVE_INFINITY;
  for (const value of values) if (value < least && value > Number.NEGATIVE_INFINITY) least = value;
  return Number.isFinite(least) ? least : null;
}

/** Positions of a texture's samples along one axis, in voxels of the finest resolution level. */
export type Places = Readonly<{ first: number; apart: number; count: number }>;

/**
 * Returns positions about `step` apart, from the first voxel of the finest resolution level to the
 * last one, and `apron` more beyond each end. The volume's box is thus the same as that of a build,
 * whichever level is shown.
 */
export function placesAlong(voxels: number, step: number, apron: number): Places {
  const last = voxels - 1;
  const count = last > 0 ? Math.max(2, Math.round(last / step) + 1) : 1;
  const apart = count > 1 ? last / (count - 1) : step;
  return { first: -apron * apart, apart, count: count + 2 * apron };
}

/**
 * Returns the values at a grid of positions, by linear interpolation. Beyond the outermost voxels
 * their values continue.
 */
export function resample(
  volume: CoarseVolume,
  places: readonly [Places, Places, Places],
): Float32Array<ArrayBuffer> {
  let { voxels } = volume;
  const shape = [...volume.shape];
  for (const axis of [0, 1, 2] as const) {
    const sizes = { before: product(shape.slice(0, axis)), after: product(shape.slice(axis + 1)) };
    const along = { first: volume.first[axis], step: volume.step[axis], length: shape[axis] };
    voxels = resampleAxis(voxels, along, places[axis], sizes);
    shape[axis] = places[axis].count;
  }
  return voxels;
}

const product = (numbers: readonly number[]) => numbers.reduce((all, n) => all * n, 1);

/** @param sizes voxels of the slower axes, and of the faster ones */
function resampleAxis(
  voxels: Float32Array<ArrayBuffer>,
  along: Readonly<{ first: number; step: number; length: number }>,
  places: Places,
  { before, after }: Readonly<{ before: number; after: number }>,
): Float32Array<ArrayBuffer> {
  const { length } = along;
  const { count } = places;
  const made = new Float32Array(before * count * after);
  const lows = new Int32Array(count);
  const shares = new Float32Array(count);
  for (let i = 0; i < count; i++) {
    const at = (places.first + i * places.apart - along.first) / along.step;
    const index = Math.min(Math.max(at, 0), length - 1);
    lows[i] = Math.min(Math.floor(index), Math.max(length - 2, 0));
    shares[i] = index - lows[i];
  }
  const next = length > 1 ? after : 0;
  let to = 0;
  for (let o = 0; o < before; o++) {
    for (let i = 0; i < count; i++) {
      const share = shares[i];
      let from = (o * length + lows[i]) * after;
      for (let k = 0; k < after; k++, from++) {
        const low = voxels[from];
        made[to++] = low + share * (voxels[from + next] - low);
      }
    }
  }
  return made;
}
