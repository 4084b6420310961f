/**
 * Texels of the volumes for the CPU. On the GPU they can't be read, so a level that is at hand is
 * decompressed again, in the worker; the last few stay.
 */

import { decodeTexels } from "../bundle/decode";
import type { TileVolume } from "../bundle/generated/volumes";
import type { LevelSource } from "../state/on_screen";
import { levelsToFetch, texels } from "../voxels/mip_levels";
import type { VolumeLevel } from "./measure";

/** Most bytes of memory, beside the texels that were asked for last. */
const KEPT_BYTES = 64 * 1024 * 1024;
/** Most texels of a level that is fetched where none is at hand. */
const FETCHED_TEXELS = 4 * 1024 * 1024;

type Kept = Readonly<{ bytes: number; level: Promise<VolumeLevel> }>;

/** The finest level at hand of at most so many texels; null: none. */
export function levelAtHand(source: LevelSource, most = Number.POSITIVE_INFINITY): number | null {
  const { levels } = source.volume;
  const index = levels.findIndex((level, i) => source.has(i) && texels(level) <= most);
  return index === -1 ? null : index;
}

export class TexelCache {
  private readonly kept = new Map<string, Kept>();
  private readonly abort = new AbortController();

  /** @param reopen a source of the same volume that keeps what it fetches for itself */
  constructor(private readonly reopen: (volume: TileVolume) => LevelSource) {}

  /** The finest level at hand; if there is none, null. Throws BundleError. */
  async atHand(source: LevelSource, most?: number): Promise<VolumeLevel | null> {
    const index = levelAtHand(source, most);
    return index === null ? null : this.decoded(source, index);
  }

  /** The finest level at hand; if there is none, one is fetched. Throws BundleError, AbortError. */
  async best(source: LevelSource): Promise<VolumeLevel> {
    const index = levelAtHand(source);
    if (index !== null) return this.decoded(source, index);
    const { levels } = source.volume;
    const order = levelsToFetch(levels, FETCHED_TEXELS, Number.POSITIVE_INFINITY);
    return this.decoded(this.reopen(source.volume), order[order.length - 1]);
  }

  /** The finest level of at most so many texels, or the coarsest; fetched, if need be. Throws BundleError, AbortError. */
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
    this.kept.delete(key); // and to the end: the last one used
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
