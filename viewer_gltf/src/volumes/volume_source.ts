/**
 * Mip levels of one volume file by HTTP range, still compressed, and its bricks. A host that knows
 * no ranges answers the first request with the whole file, which then serves every level.
 */
import { BundleError } from "../bundle/errors";
import { checkFile, fetchFile, fileAddress, readBody, request } from "../bundle/fetch";
import type { TileVolume } from "../bundle/generated/volumes";
import { checkHash } from "../bundle/hash";
import { compressedLevel, readLevel, readTexture } from "../bundle/ktx2";
import { brickCounts } from "./skip_bricks";

export class VolumeSource {
  private whole: Uint8Array<ArrayBuffer> | null = null;
  /** What has come of a volume stays while it is wanted: another set of channels packs it anew. */
  private readonly levels = new Map<number, Uint8Array>();
  private ranges: Uint8Array | null = null;

  constructor(
    private readonly base: string,
    readonly volume: TileVolume,
  ) {}

  /** Whether a level needs no fetching. */
  has(index: number): boolean {
    return this.levels.has(index);
  }

  /** Smallest and largest intensity of every brick, interleaved. Throws BundleError, AbortError. */
  async bricks(signal: AbortSignal): Promise<Uint8Array> {
    if (this.ranges === null) {
      const { bricks, size } = this.volume;
      const file = await fetchFile(this.base, bricks, signal);
      const texture = readTexture(file, bricks.path, "R8G8", brickCounts(size));
      this.ranges = await readLevel(texture, bricks.path, "R8G8", 0);
    }
    return this.ranges;
  }

  /** The zstd frame of level `index`. Throws BundleError, or AbortError. */
  async level(index: number, signal: AbortSignal): Promise<Uint8Array> {
    let bytes = this.levels.get(index);
    if (bytes === undefined) {
      bytes = await this.fetchLevel(index, signal);
      this.levels.set(index, bytes);
    }
    return bytes;
  }

  /** Forget what was fetched. */
  release(): void {
    this.levels.clear();
    this.ranges = null;
    this.whole = null;
  }

  private async fetchLevel(index: number, signal: AbortSignal): Promise<Uint8Array> {
    const { file, size } = this.volume;
    const part = this.whole === null ? await this.fetchRange(index, signal) : null;
    if (part !== null) return part;
    if (this.whole === null) throw new Error("a whole file was promised");
    const texture = readTexture(this.whole, file.path, "R8", size);
    const frame = compressedLevel(texture, file.path, index);
    if (frame === null) {
      throw new BundleError(`${file.path}: supercompression: expected zstd, found none`);
    }
    return frame;
  }

  /**
   * The compressed bytes of a level, or null if the host sent the whole file (then it is kept). What
   * was spoilt on its way may lie in a cache since: it is asked for once more, past all caches.
   */
  private async fetchRange(
    index: number,
    signal: AbortSignal,
    cache: RequestCache = "default",
  ): Promise<Uint8Array | null> {
    const { file, levels } = this.volume;
    const level = levels[index];
    const last = level.offset + level.length - 1;
    const response = await request(fileAddress(this.base, file.path), file.path, {
      signal,
      cache,
      headers: { Range: `bytes=${level.offset}-${last}` },
    });
    const bytes = await readBody(response, file.path);
    if (response.status !== 206) {
      await checkFile(file, bytes);
      this.whole = bytes;
      return null;
    }
    const total = response.headers.get("Content-Range")?.split("/")[1];
    if (total !== undefined && total !== "*" && Number(total) !== file.bytes) {
      throw new BundleError(`${file.path}: expected ${file.bytes} bytes, found ${total}`);
    }
    if (bytes.length !== level.length) {
      throw new BundleError(
        `${file.path}: expected ${level.length} bytes of a range, found ${bytes.length}`,
      );
    }
    try {
      await checkHash(`${file.path}: level ${index}`, bytes, level.sha256);
    } catch (error) {
      if (cache === "reload" || !(error instanceof BundleError)) throw error;
      return this.fetchRange(index, signal, "reload");
    }
    return bytes;
  }
}
