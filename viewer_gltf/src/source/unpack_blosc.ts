/**
 * Unpacks Blosc 1, in which most OME-Zarr 0.4 is written.
 *
 * The package numcodecs is not used. It contains c-blosc as WebAssembly together with the compressor (600 kB), and its
 * glue code makes functions from text, which the page's security policy forbids.
 *
 * References: https://github.com/Blosc/c-blosc/blob/main/README_CHUNK_FORMAT.rst
 */
import { ZSTDDecoder } from "zstddec/stream";
import { unpackBloscLz, unpackLz4 } from "./unpack";
import { partsOf } from "./zip_store";

const HEADER_BYTES = 16;
/** Flags of the header. */
const [SHUFFLED, COPIED, BIT_SHUFFLED, UNSPLIT] = [1, 2, 4, 16];
/** Blocks have a stream for each byte of a value if values have at most 16 bytes, and blocks at least 128 values. */
const [MAX_SPLITS, MIN_SPLIT] = [16, 128];
/** Largest size of a chunk after it is unpacked, bytes. */
const MAX_BYTES = 1 << 30;

const zstd = new ZSTDDecoder();

type Unpack = (packed: Uint8Array<ArrayBuffer>, bytes: number) => Uint8Array | Promise<Uint8Array>;

/** The codecs by their number in the header. */
const CODECS: Readonly<Record<number, Unpack>> = {
  0: unpackBloscLz,
  1: unpackLz4,
  3: unpackZlib,
  4: async (packed, bytes) => {
    await zstd.init();
    return zstd.decode(packed, bytes);
  },
};

/** Unpacks a chunk. Throws RangeError if it is damaged, or packed by an unknown codec. */
export async function unpackBlosc(given: Uint8Array): Promise<Uint8Array> {
  const packed = given as Uint8Array<ArrayBuffer>;
  const view = new DataView(packed.buffer, packed.byteOffset, packed.byteLength);
  if (packed.length < HEADER_BYTES) throw new RangeError("a chunk of blosc is cut short");
  const [flags, typeSize] = [packed[2], Math.max(1, packed[3])];
  const [bytes, blockBytes] = [view.getUint32(4, true), view.getUint32(8, true)];
  if (bytes > MAX_BYTES || packed.length < view.getUint32(12, true)) {
    throw new RangeError("a chunk of blosc is cut short, or too large");
  }
  if ((flags & COPIED) !== 0) {
    if (packed.length < HEADER_BYTES + bytes) throw new RangeError("a chunk of blosc is cut short");
    return packed.slice(HEADER_BYTES, HEADER_BYTES + bytes);
  }
  const unpack = CODECS[flags >> 5];
  if (unpack === undefined) throw new RangeError(`blosc packs by an unknown codec, ${flags >> 5}`);
  const out = new Uint8Array(bytes);
  for (let block = 0, at = 0; at < bytes; block++, at += blockBytes) {
    if (blockBytes === 0) throw new RangeError("a chunk of blosc has blocks of no size");
    const size = Math.min(blockBytes, bytes - at);
    const isSplit =
      (flags & UNSPLIT) === 0 &&
      typeSize <= MAX_SPLITS &&
      blockBytes / typeSize >= MIN_SPLIT &&
      size === blockBytes;
    const streams = isSplit ? typeSize : 1;
    const values = new Uint8Array(size);
    let from = view.getUint32(HEADER_BYTES + 4 * block, true);
    for (let stream = 0; stream < streams; stream++) {
      const length = view.getUint32(from, true);
      const expected = size / streams;
      const content = packed.subarray(from + 4, from + 4 + length);
      if (content.length < length) throw new RangeError("a chunk of blosc is cut short");
      values.set(
        length === expected ? content : await unpack(content, expected),
        stream * expected,
      );
      from += 4 + length;
    }
    out.set(unshuffled(values, typeSize, flags), at);
  }
  return out;
}

function unshuffled(values: Uint8Array, typeSize: number, flags: number): Uint8Array {
  if ((flags & SHUFFLED) !== 0 && typeSize > 1) return unshuffleBytes(values, typeSize);
  return (flags & BIT_SHUFFLED) !== 0 ? unshuffleBits(values, typeSize) : values;
}

/** Reverses a byte shuffle, which stores the first bytes of all values side by side, then the second bytes. */
function unshuffleBytes(values: Uint8Array, typeSize: number): Uint8Array {
  const count = Math.floor(values.length / typeSize);
  const out = values.slice(); // the remaining bytes at the end are not shuffled
  for (let byte = 0; byte < typeSize; byte++) {
    const from = byte * count;
    for (let i = 0, to = byte; i < count; i++, to += typeSize) out[to] = values[from + i];
  }
  return out;
}

/** Reverses a bit shuffle, which stores the first bits of all values side by side, then the second bits. */
function unshuffleBits(values: Uint8Array, typeSize: number): Uint8Array {
  const count = Math.floor(values.length / typeSize);
  if (count % 8 !== 0) return values; // such blocks are not shuffled
  const out = values.slice();
  out.fill(0, 0, count * typeSize);
  const row = count / 8;
  for (let bit = 0; bit < 8 * typeSize; bit++) {
    const [byte, mask] = [bit >> 3, 1 << (bit & 7)];
    for (let i = 0; i < row; i++) {
      const eight = values[bit * row + i];
      for (let k = 0; k < 8; k++) {
        if ((eight >> k) & 1) out[(8 * i + k) * typeSize + byte] |= mask;
      }
    }
  }
  return out;
}

async function unpackZlib(packed: Uint8Array<ArrayBuffer>, bytes: number): Promise<Uint8Array> {
  const out = new Uint8Array(bytes);
  let at = 0;
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  for await (const part of partsOf(stream)) {
    out.set(part, at); // throws if the streams contain more than fits into the block
    at += part.length;
  }
  return out;
}
