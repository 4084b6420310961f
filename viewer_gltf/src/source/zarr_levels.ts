/** Chooses the resolution level of an OME-Zarr image to show, and finds where its voxels lie. */
import * as zarr from "zarrita";
import { type LevelPlace, READ_FACTOR, type Triple, triple, volumeOf } from "./coarse_volume";
import type { NgffImage } from "./ngff";
import { SourceError } from "./source_error";
import { explained } from "./zarr_faults";

/** Largest chunk, bytes, unpacked. */
const MAX_CHUNK_BYTES = 1 << 28;
const NUMBERS = /^(u?int(8|16|32|64)|float(32|64))$/;

export type Store = zarr.AsyncReadable;
export type Level = zarr.Array<zarr.DataType, Store>;

export async function openLevel(
  store: Store,
  image: NgffImage,
  level: number,
  name: string,
): Promise<Level> {
  const { path } = image.levels[level];
  const where = `${name}: level ${path}`;
  const array = await explained(where, () =>
    zarr.open(zarr.root(store).resolve(path), { kind: "array" }),
  );
  const { shape, dtype, chunks } = array;
  if (shape.length !== image.axes.length || shape.some((n) => n < 1)) {
    throw new SourceError(
      `${where}: shape is ${shape.join(" x ")}, expected the ${image.axes.length} axes that \`axes\` lists.`,
    );
  }
  if (!NUMBERS.test(dtype)) {
    throw new SourceError(
      `${where}: data type is ${dtype}, expected integers, or floating-point numbers of 32 or 64 bits.`,
    );
  }
  const bytes = chunks.reduce((product, n) => product * n, Number(/\d+/.exec(dtype)?.[0]) / 8);
  if (bytes > MAX_CHUNK_BYTES) {
    throw new SourceError(
      `${where}: found chunks of ${Math.round(bytes / 1e6)} MB, expected at most ${Math.round(MAX_CHUNK_BYTES / 1e6)} MB: open the ` +
        "image with stereocell view, or ask its author for smaller chunks.",
    );
  }
  return array;
}

/**
 * Returns the finest resolution level that is small enough; if none is, the coarsest, which is then
 * reduced to means of blocks. Throws SourceError if the coarsest has more than READ_FACTOR times as
 * many voxels.
 *
 * @param most largest number of voxels of a channel
 */
export async function chooseLevel(
  store: Store,
  image: NgffImage,
  finest: Level,
  most: number,
  name: string,
): Promise<Readonly<{ level: number; array: Level }>> {
  const last = image.levels.length - 1;
  const mostRead = READ_FACTOR * most;
  for (let level = 0; ; level++) {
    const array = level === 0 ? finest : await openLevel(store, image, level, name);
    const voxels = volumeOf(spatial(image.axes, array.shape));
    if (voxels <= (level === last ? mostRead : most)) return { level, array };
    if (level === last) {
      const millions = (n: number) => `${Math.round(n / 1e6)} million voxels`;
      throw new SourceError(
        `${name}: the coarsest level has ${millions(voxels)} per channel, expected at most ${millions(mostRead)}: open ` +
          "the image with stereocell view, or ask its author to add coarser levels.",
      );
    }
  }
}

/** Returns the values for the axes z, y and x. */
export const spatial = (axes: readonly string[], values: readonly number[]): Triple =>
  triple((i) => values[axes.indexOf("zyx"[i])]);

/** Returns where a level's voxels lie: by the stated scales, or by the level's shape if no scales are stated. */
export function placeOfLevel(
  { levels }: NgffImage,
  level: number,
  shape: Triple,
  levelShape: Triple,
  scale: Triple,
): LevelPlace {
  const own = levels[level];
  const step = triple((i) => {
    const byShape = shape[i] / levelShape[i];
    if (own.scale_um === null) return byShape;
    const stated = own.scale_um[i] / scale[i];
    // All levels cover the same field. If a level's scale contradicts this, its shape decides.
    return Math.abs(shape[i] / stated - levelShape[i]) <= 1 + 1e-6 ? stated : byShape;
  });
  const [to, from] = [own.shift_um, levels[0].shift_um];
  const first = triple((i) => {
    if (level === 0 || to === null || from === null) return (step[i] - 1) / 2;
    return (to[i] - from[i]) / scale[i];
  });
  return { first, step };
}
