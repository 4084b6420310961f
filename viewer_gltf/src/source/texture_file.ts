/** KTX2 textures with a zstd frame for each level, as the pipeline writes them; but no frame is compressed. */
import {
  createDefaultContainer,
  KHR_DF_MODEL_RGBSDA,
  KHR_DF_TRANSFER_LINEAR,
  KHR_SUPERCOMPRESSION_ZSTD,
  VK_FORMAT_R8_UNORM,
  VK_FORMAT_R8G8_UNORM,
  VK_FORMAT_R8G8B8A8_UNORM,
  write,
} from "ktx-parse";

const FORMATS = {
  1: VK_FORMAT_R8_UNORM,
  2: VK_FORMAT_R8G8_UNORM,
  4: VK_FORMAT_R8G8B8A8_UNORM,
} as const;
const CHANNEL_TYPES = [0, 1, 2, 15]; // R, G, B, A of KHR_DF_MODEL_RGBSDA

/** Bytes of a zstd block, at most. */
const MAX_BLOCK = 128 * 1024;

/** A zstd frame of raw blocks (RFC 8878, 3.1.1): stored, not compressed, since no browser has an encoder. */
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
  /** The place of each level's frame in the file, finest first. */
  levels: readonly Readonly<{ offset: number; length: number }>[];
}>;

/**
 * @param size   texels x, y, z
 * @param levels texels of each level, finest first; `channels` bytes a texel
 */
export function writeKtx2(
  size: readonly [number, number, number],
  channels: 1 | 2 | 4,
  levels: readonly Uint8Array[],
): Texture {
  const container = createDefaultContainer();
  container.vkFormat = FORMATS[channels];
  [container.pixelWidth, container.pixelHeight] = size;
  container.pixelDepth = channels === 4 ? 0 : size[2]; // the LUT is a 2D texture
  container.levelCount = levels.length;
  container.supercompressionScheme = KHR_SUPERCOMPRESSION_ZSTD;
  container.levels = levels.map((data) => ({
    levelData: storeZstd(data),
    uncompressedByteLength: data.length,
  }));
  const [descriptor] = container.dataFormatDescriptor;
  descriptor.colorModel = KHR_DF_MODEL_RGBSDA;
  descriptor.transferFunction = KHR_DF_TRANSFER_LINEAR;
  descriptor.bytesPlane = [channels, 0, 0, 0, 0, 0, 0, 0];
  descriptor.samples = Array.from({ length: channels }, (_, i) => ({
    bitOffset: 8 * i,
    bitLength: 7,
    channelType: CHANNEL_TYPES[i],
    samplePosition: [0, 0, 0, 0],
    sampleLower: 0,
    sampleUpper: 255,
  }));
  const file = new Uint8Array(write(container));
  // KTX 2.0, section 3.9: the level index starts at byte 80, three uint64 a level.
  const view = new DataView(file.buffer);
  return {
    file,
    levels: levels.map((_, i) => ({
      offset: Number(view.getBigUint64(80 + 24 * i, true)),
      length: Number(view.getBigUint64(88 + 24 * i, true)),
    })),
  };
}
