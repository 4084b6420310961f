/** Reads whole KTX2 textures: checks format and size, and decompresses mip levels. */
import {
  KHR_SUPERCOMPRESSION_NONE,
  KHR_SUPERCOMPRESSION_ZSTD,
  type KTX2Container,
  read,
  VK_FORMAT_R8_UNORM,
  VK_FORMAT_R8G8_UNORM,
  VK_FORMAT_R8G8B8A8_UNORM,
} from "ktx-parse";
import { decodeTexels } from "./decode";
import { BundleError } from "./errors";

export type Size3 = readonly [number, number, number];

/** Bytes per texel of each format that a bundle uses; the keys are the names in messages. */
export const FORMATS = {
  R8: { vk: VK_FORMAT_R8_UNORM, bytes: 1 },
  R8G8: { vk: VK_FORMAT_R8G8_UNORM, bytes: 2 },
  R8G8B8A8: { vk: VK_FORMAT_R8G8B8A8_UNORM, bytes: 4 },
} as const;

/** Returns the parsed container. Throws BundleError unless format and size of level 0 are as expected. */
export function readTexture(
  file: Uint8Array<ArrayBuffer>,
  path: string,
  format: keyof typeof FORMATS,
  size: Size3,
): KTX2Container {
  let texture: KTX2Container;
  try {
    texture = read(file);
  } catch (error) {
    throw new BundleError(
      `${path}: found another kind of file (${String(error)}), expected a KTX2 texture`,
      { cause: error },
    );
  }
  if (texture.vkFormat !== FORMATS[format].vk) {
    throw new BundleError(
      `${path}: vkFormat is ${texture.vkFormat}, expected ${FORMATS[format].vk} (${format})`,
    );
  }
  const found = [texture.pixelWidth, texture.pixelHeight, texture.pixelDepth || 1];
  if (found.some((n, i) => n !== size[i])) {
    throw new BundleError(`${path}: size is ${found.join(" x ")}, expected ${size.join(" x ")}`);
  }
  return texture;
}

/** Returns the texels of one mip level, x fastest. Throws BundleError. */
export async function readLevel(
  texture: KTX2Container,
  path: string,
  format: keyof typeof FORMATS,
  index: number,
): Promise<Uint8Array<ArrayBuffer>> {
  const level = texture.levels[index];
  if (level === undefined) {
    throw new BundleError(
      `${path}: found ${texture.levels.length} levels, expected mip level ${index}`,
    );
  }
  const side = (n: number) => Math.max(1, n >> index);
  const size =
    side(texture.pixelWidth) *
    side(texture.pixelHeight) *
    side(texture.pixelDepth || 1) *
    FORMATS[format].bytes;
  switch (texture.supercompressionScheme) {
    case KHR_SUPERCOMPRESSION_ZSTD:
      return decodeTexels([{ bytes: level.levelData, name: path }], size);
    case KHR_SUPERCOMPRESSION_NONE:
      if (level.levelData.length !== size) {
        throw new BundleError(
          `${path}: level ${index}: found ${level.levelData.length} bytes, expected ${size}`,
        );
      }
      return new Uint8Array(level.levelData);
    default:
      throw new BundleError(
        `${path}: supercompression scheme is ${texture.supercompressionScheme}, expected zstd or none`,
      );
  }
}

/**
 * Returns the zstd frame of one mip level; null if the texture is not compressed. Throws
 * BundleError.
 */
export function compressedLevel(
  texture: KTX2Container,
  path: string,
  index: number,
): Uint8Array | null {
  const level = texture.levels[index];
  if (level === undefined) {
    throw new BundleError(
      `${path}: found ${texture.levels.length} levels, expected mip level ${index}`,
    );
  }
  return texture.supercompressionScheme === KHR_SUPERCOMPRESSION_ZSTD ? level.levelData : null;
}
