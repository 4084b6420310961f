import { ZSTDDecoder } from "zstddec/stream";

const decoder = new ZSTDDecoder();

/** Replaces `numcodecs/zstd` (see vite.config.ts). */
export default class Zstd {
  static readonly codecId = "zstd";

  static fromConfig(): Zstd {
    return new Zstd();
  }

  async decode(packed: Uint8Array): Promise<Uint8Array> {
    await decoder.init();
    // A frame need not state its unpacked size; the streaming decoder then unpacks it part by part.
    return decoder.decode(packed);
  }
}
