import { ZSTDDecoder } from "zstddec/stream";

const decoder = new ZSTDDecoder();

/** Takes the place of `numcodecs/zstd`: see vite.config.ts. */
export default class Zstd {
  static readonly codecId = "zstd";

  static fromConfig(): Zstd {
    return new Zstd();
  }

  async decode(packed: Uint8Array): Promise<Uint8Array> {
    await decoder.init();
    // a frame need not state its size: then it is unpacked part by part
    return decoder.decode(packed);
  }
}
