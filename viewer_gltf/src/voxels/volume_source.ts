/**
 * Mip levels of one volume file by HTTP range, still compressed, and the ranges of its bricks. A
 * host without range support answers the first request with the whole file, which then serves all
 * levels.
 */
import { BundleError } from "../bundle/errors";
import { fetchFile, fetchPart } from "../bundle/fetch";
import type { TileVolume } from "../bundle/generated/volumes";
import { compressedLevel, readLevel, readTexture } from "../bundle/ktx2";
import { brickCounts } from "./skip_bricks";

/**
 * The volume with the size of its brick tree, which is finer if the host reads bricks from the
 * source.
 */
export function volumeOfBricks(volume: TileVolume): TileVolume {
  return volume.finer_size === undefined ? volume : { ...volume, size: volume.finer_size };
}

export class VolumeSource {
  private whole: Uint8Array<ArrayBuffer> | null = null;
  /**
   * Loaded mip levels by their index. They are kept while the volume is wanted, because they are
   * packed again for another set of channels.
   */
  private readonly levels = new Map<number, Uint8Array>();
  private ranges: Uint8Array | null = null;

  constructor(
    private readonly base: string,
    readonly volume: TileVolume,
  ) {}

  has(index: number): boolean {
    return this.levels.has(index);
  }

  /**
   * Smallest and largest intensity of each brick, interleaved. Throws BundleError or AbortError.
   */
  async bricks(signal: AbortSignal): Promise<Uint8Array> {
    if (this.ranges === null) {
      const { bricks, size } = this.volume;
      const file = await fetchFile(this.base, bricks, signal);
      const texture = readTexture(file, bricks.path, "R8G8", brickCounts(size));
      this.ranges = await readLevel(texture, bricks.path, "R8G8", 0);
    }
    return this.ranges;
  }

  /** Returns the zstd frame of mip level `index`. Throws BundleError or AbortError. */
  async level(index: number, signal: AbortSignal): Promise<Uint8Array> {
    let bytes = this.levels.get(index);
    if (bytes === undefined) {
      bytes = await this.fetchLevel(index, signal);
      this.levels.set(index, bytes);
    }
    return bytes;
  }

  release(): void {
    this.levels.clear();
    this.ranges = null;
    this.whole = null;
  }

  private async fetchLevel(index: number, signal: AbortSignal): Promise<Uint8Array> {
    const { file, levels, size } = this.volume;
    if (this.whole === null) {
      const level = levels[index];
      const part = await fetchPart(this.base, file, level, `level ${index}`, signal);
      if (!part.isWhole) return part.bytes;
      this.whole = part.bytes;
    }
    const texture = readTexture(this.whole, file.path, "R8", size);
    const frame = compressedLevel(texture, file.path, index);
    if (frame === null) {
      throw new BundleError(`${file.path}: supercompression is missing, expected zstd`);
    }
    return frame;
  }
}
