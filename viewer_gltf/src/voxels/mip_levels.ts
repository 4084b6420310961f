/** The mip levels of a volume to fetch, coarse first. */
import type { MipLevel } from "../bundle/generated/volumes";

/** Largest size, in bytes, of the mip level that is fetched first, for a quick first image. */
const FIRST_LEVEL_BYTES = 64 * 1024;

/** Limits of GPU memory and of texture sizes for volumes. */
export type VolumeLimits = Readonly<{
  /** Largest size in GPU memory, bytes. */
  bytes: number;
  /** Largest number of texels along an edge of a texture. */
  side: number;
  /** Largest number of voxels along a tile's edge; Infinity: as many as fit. */
  edge: number;
}>;

export function texels(level: MipLevel): number {
  const [x, y, z] = level.size;
  return x * y * z;
}

/**
 * Returns indices into `levels` (which go from fine to coarse) in the order of fetching. A small
 * level comes first, then each finer one. The last is the finest that fits into `budget_bytes` (one
 * byte per texel) and whose sides the GPU supports. The coarsest is always allowed.
 */
export function levelsToFetch(
  levels: readonly MipLevel[],
  budget_bytes: number,
  maxSide: number,
): readonly number[] {
  const coarsest = levels.length - 1;
  const fits = (level: MipLevel) =>
    texels(level) <= budget_bytes && Math.max(...level.size) <= maxSide;
  const found = levels.findIndex(fits);
  const finest = found === -1 ? coarsest : found;
  let first = levels.findIndex((level) => texels(level) <= FIRST_LEVEL_BYTES);
  if (first === -1) first = coarsest;
  first = Math.max(first, finest);
  return Array.from({ length: first - finest + 1 }, (_, i) => first - i);
}
