/**
 * Writes KTX2 textures with a zstd frame for each level, like pipeline/stereocell/formats/ktx2.py but without
 * compression. The writer of ktx-parse is not used: it is in one module with its reader, and would thus be part of the
 * first file that the page loads.
 *
 * References: KTX 2.0 specification, Khronos, revision 2.0.4
 */

const IDENTIFIER = [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];
const HEADER_BYTES = 80;
/** Bytes of a level's entry in the index: offset, length and unpacked length, uint64 each. */
const LEVEL_BYTES = 24;
/** Bytes of the parts of the data format descriptor: its own size, the basic block, and each sample. */
const [SIZE_BYTES, BLOCK_BYTES, SAMPLE_BYTES] = [4, 24, 16];
/** R8_UNORM, R8G8_UNORM and R8G8B8A8_UNORM of Vulkan, by the number of components. */
const VK_FORMATS = { 1: 9, 2: 16, 4: 37 } as const;
const CHANNEL_TYPES = [0, 1, 2, 15]; // red, green, blue, alpha
const SCHEME_ZSTD = 2;
/** Version of the descriptor; its colour model RGBSDA, primaries BT.709 and linear transfer are all number 1. */
const DESCRIPTOR_VERSION = 2;
const WRITER = "KTXwriter\0StereoCell\0";

/** Largest zstd block, bytes. */
const MAX_BLOCK = 128 * 1024;

/** Returns a zstd frame of raw blocks (RFC 8878, 3.1.1), not compressed, since browsers have no encoder. */
export function storeZstd(data: Uint8Array): Uint8Array<ArrayBuffer> {
  const blocks = Math.max(1, Math.ceil(data.length / MAX_BLOCK));
  const frame = new Uint8Array(9 + 3 * blocks + data.length);
  // Magic number; descriptor: single segment, 4 bytes of content size.
  frame.set([0x28, 0xb5, 0x2f, 0xfd, 0xa0]);
  new DataView(frame.buffer).setUint32(5, data.length, true);
  for (let block = 0, at = 9; block < blocks; block++) {
    const part = data.subarray(block * MAX_BLOCK, (block + 1) * MAX_BLOCK);
    const word = (part.length << 3) | (block === blocks - 1 ? 1 : 0);
    frame.set([word & 255, (word >> 8) & 255, (word >> 16) & 255], at);
    frame.set(part, at + 3);
    at += 3 + part.length;
  }
  return frame;
}

export type Texture = Readonly<{
  file: Uint8Array<ArrayBuffer>;
  /** Offset and length, bytes, of each mip level's zstd frame in the file, finest first. */
  levels: readonly Readonly<{ offset: number; length: number }>[];
}>;

/**
 * @param size   texels x, y, z
 * @param levels texels of each mip level, finest first; `channels` bytes a texel
 */
export function writeKtx2(
  size: readonly [number, number, number],
  channels: 1 | 2 | 4,
  levels: readonly Uint8Array[],
): Texture {
  const frames = levels.map(storeZstd);
  const descriptorBytes = SIZE_BYTES + BLOCK_BYTES + SAMPLE_BYTES * channels;
  const descriptor = HEADER_BYTES + LEVEL_BYTES * levels.length;
  const writer = descriptor + descriptorBytes;
  const writerBytes = 4 + 4 * Math.ceil(WRITER.length / 4);
  const first = writer + writerBytes;
  const file = new Uint8Array(frames.reduce((end, frame) => end + frame.length, first));
  const view = new DataView(file.buffer);
  const put32 = (at: number, ...values: readonly number[]) =>
    values.forEach((value, i) => {
      view.setUint32(at + 4 * i, value, true);
    });
  file.set(IDENTIFIER);
  const depth = channels === 4 ? 0 : size[2]; // the LUT is a 2D texture
  put32(12, VK_FORMATS[channels], 1, size[0], size[1], depth, 0, 1, levels.length, SCHEME_ZSTD);
  put32(48, descriptor, descriptorBytes, writer, writerBytes);
  put32(descriptor, descriptorBytes, 0);
  const block = descriptor + SIZE_BYTES + 4;
  put32(block, DESCRIPTOR_VERSION | ((descriptorBytes - SIZE_BYTES) << 16));
  file.set([1, 1, 1, 0, 0, 0, 0, 0, channels], block + 4);
  for (let i = 0; i < channels; i++) {
    const sample = descriptor + SIZE_BYTES + BLOCK_BYTES + SAMPLE_BYTES * i;
    put32(sample, (8 * i) | (7 << 16) | (CHANNEL_TYPES[i] << 24), 0, 0, 255);
  }
  put32(writer, WRITER.length);
  file.set(new TextEncoder().encode(WRITER), writer + 4);
  const places = new Array<{ offset: number; length: number }>(frames.length);
  for (let i = frames.length - 1, offset = first; i >= 0; i--) {
    const { length } = frames[i];
    file.set(frames[i], offset);
    const numbers = [offset, length, levels[i].length];
    numbers.forEach((value, k) => {
      view.setBigUint64(HEADER_BYTES + LEVEL_BYTES * i + 8 * k, BigInt(value), true);
    });
    places[i] = { offset, length };
    offset += length;
  }
  return { file, levels: places };
}
