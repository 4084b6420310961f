import { unpackBlosc } from "../unpack_blosc";

/** Replaces `numcodecs/blosc` (see vite.config.ts). */
export default class Blosc {
  static readonly codecId = "blosc";

  static fromConfig(): Blosc {
    return new Blosc();
  }

  decode(packed: Uint8Array): Promise<Uint8Array> {
    return unpackBlosc(packed);
  }
}
