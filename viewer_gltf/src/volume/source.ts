/**
 * Mip levels of one volume file by HTTP range. A host that knows no ranges answers the first
 * request with the whole file, which then serves every level.
 */
import { BundleError } from "../bundle/errors";
import { checkFile, fileAddress, readBody, request } from "../bundle/fetch";
import type { TileVolume } from "../bundle/generated/volumes";
import { readLevel, readTexture } from "./ktx2";
import { texels } from "./levels";
import { unzstd } from "./zstd";

export class VolumeSource {
  private whole: Uint8Array<ArrayBuffer> | null = null;

  constructor(
    private readonly base: string,
    readonly volume: TileVolume,
  ) {}

  /** The texels of level `index`, x fastest. Throws BundleError, or AbortError. */
  async fetchLevel(index: number, signal: AbortSignal): Promise<Uint8Array<ArrayBuffer>> {
    const { file, levels, size } = this.volume;
    const level = levels[index];
    const part = this.whole === null ? await this.fetchRange(level, signal) : null;
    if (part !== null) {
      return unzstd(part, texels(level), `${file.path}: level ${index}`);
    }
    if (this.whole === null) throw new Error("a whole file was promised");
    const texture = readTexture(this.whole, file.path, "R8", size);
    return readLevel(texture, file.path, "R8", index);
  }

  /** The compressed bytes of a level, or null if the host sent the whole file (then it is kept). */
  private async fetchRange(
    level: { offset: number; length: number },
    signal: AbortSignal,
  ): Promise<Uint8Array | null> {
    const { file } = this.volume;
    const last = level.offset + level.length - 1;
    const response = await request(fileAddress(this.base, file.path), file.path, {
      signal,
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
    return bytes;
  }
}
