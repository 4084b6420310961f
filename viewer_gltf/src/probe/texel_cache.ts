/**
 * Provides texels of the volumes to the CPU. Texels on the GPU can't be read back, so an available
 * mip level is decompressed again in the worker. The most recently used levels stay in memory.
 */

import { decodeTexels } from "../bundle/decode";
import type { TileVolume } from "../bundle/generated/volumes";
import type { LevelSource } from "../state/on_screen";
import { levelsToFetch, texels } from "../voxels/mip_levels";
import type { VolumeLevel } from "./measure";

/** Largest size of the cache, bytes; the level that was requested last is kept even if it is larger. */
const KEPT_BYTES = 64 * 1024 * 1024;
/** Largest number of texels of the mip level that is fetched if no level is available. */
const FETCHED_TEXELS = 4 * 1024 * 1024;

type Kept = Readonly<{ bytes: number; level: Promise<VolumeLevel> }>;

/** Returns the finest available level of at most `most` texels; null if there is none. */
export function availableLevel(
  source: LevelSource,
  most = Number.POSITIVE_INFINITY,
): number | null {
  const { levels } = source.volume;
  const index = levels.findIndex((level, i) => source.has(i) && texels(level) <= most);
  return index === -1 ? null : index;
}

export class TexelCache {
  private readonly kept = new Map<string, Kept>();
  private readonly abort = new AbortController();

  /** @param reopen makes another source of the same volume, whose fetched levels the shown one does not see */
  constructor(private readonly reopen: (volume: TileVolume) => LevelSource) {}

  /** Returns the finest available level of at most `most` texels; null if there is none. Throws BundleError. */
  async available(source: LevelSource, most?: number): Promise<VolumeLevel | null> {
    const index = availableLevel(source, most);
    return index === null ? null : this.decoded(source, index);
  }

  /** Returns the finest available level; fetches one if there is none. Throws BundleError, AbortError. */
  async best(source: LevelSource): Promise<VolumeLevel> {
    const index = availableLevel(source);
    if (index !== null) return this.decoded(source, index);
    const { levels } = source.volume;
    const order = levelsToFetch(levels, FETCHED_TEXELS, Number.POSITIVE_INFINITY);
    return this.decoded(this.reopen(source.volume), order[order.length - 1]);
  }

  /**
   * Returns the finest level of at most `most` texels, or the coarsest; fetches it if needed. Throws BundleError,
   * AbortError.
   */
  within(source: LevelSource, most: number): Promise<VolumeLevel> {
    const { levels } = source.volume;
    const found = levels.findIndex((level) => texels(level) <= most);
    const index = found === -1 ? levels.length - 1 : found;
    return this.decoded(source.has(index) ? source : this.reopen(source.volume), index);
  }

  private decoded(source: LevelSource, index: number): Promise<VolumeLevel> {
    const { file, levels } = source.volume;
    const key = `${file.path} ${file.sha256} ${index}`;
    const before = this.kept.get(key);
    this.kept.delete(key); // adding the level again at the end makes it the most recently used
    const bytes = texels(levels[index]);
    const level = before?.level ?? this.decode(source, index, bytes);
    this.kept.set(key, { bytes, level });
    level.catch(() => this.kept.delete(key));
    this.evict();
    return level;
  }

  private async decode(source: LevelSource, index: number, bytes: number): Promise<VolumeLevel> {
    const { file, levels } = source.volume;
    const frame = await source.level(index, this.abort.signal);
    const name = `${file.path}: level ${index}`;
    return {
      size: levels[index].size,
      texels: await decodeTexels([{ bytes: frame, name }], bytes),
    };
  }

  private evict(): void {
    let sum = 0;
    for (const [key, { bytes }] of [...this.kept].reverse()) {
      if (sum > 0 && sum + bytes > KEPT_BYTES) this.kept.delete(key);
      else sum += bytes;
    }
  }

  dispose(): void {
    this.abort.abort();
    this.kept.clear();
  }
}
