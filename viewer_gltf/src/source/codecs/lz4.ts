import { unpackLz4 } from "../unpack";

/** Largest chunk that is unpacked, bytes. */
const MAX_BYTES = 1 << 30;

/** Replaces `numcodecs/lz4` (see vite.config.ts). A chunk is its unpacked size, followed by a block of LZ4. */
export default class Lz4 {
  static readonly codecId = "lz4";

  static fromConfig(): Lz4 {
    return new Lz4();
  }

  async decode(packed: Uint8Array): Promise<Uint8Array> {
    const bytes = new DataView(packed.buffer, packed.byteOffset).getUint32(0, true);
    if (bytes > MAX_BYTES) throw new RangeError(`a chunk unpacks to ${bytes} bytes`);
    return unpackLz4(packed.subarray(4), bytes);
  }
}
