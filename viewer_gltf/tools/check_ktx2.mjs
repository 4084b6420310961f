/**
 * Reads KTX2 textures with ktx-parse, from .ktx2 files and from .glb files, and checks the rules of KTX 2.0 and of
 * KHR_texture_basisu that ktx-parse does not check.
 *
 * stdin: JSON array of paths. stdout: JSON array of {path, problems}, in the same order.
 */

import { readFileSync } from "node:fs";
import process from "node:process";
import { json } from "node:stream/consumers";
import {
  KHR_DF_MODEL_ETC1S,
  KHR_DF_MODEL_UASTC,
  KHR_DF_TRANSFER_LINEAR,
  KHR_DF_TRANSFER_SRGB,
  KHR_SUPERCOMPRESSION_ZSTD,
  read,
  VK_FORMAT_R8_UNORM,
  VK_FORMAT_R8G8_UNORM,
  VK_FORMAT_R8G8B8A8_UNORM,
} from "ktx-parse";
import { ZSTDDecoder } from "zstddec";
import { bytesOf, unpackGlb } from "./glb.mjs";

const TEXEL_BYTES = new Map([
  [VK_FORMAT_R8_UNORM, 1],
  [VK_FORMAT_R8G8_UNORM, 2],
  [VK_FORMAT_R8G8B8A8_UNORM, 4],
]);

function checkLevels(texture, problems) {
  const { pixelWidth, pixelHeight, pixelDepth, levels } = texture;
  const texelBytes = TEXEL_BYTES.get(texture.vkFormat);
  const longest = Math.max(pixelWidth, pixelHeight, pixelDepth);
  if (levels.length > Math.floor(Math.log2(longest)) + 1) {
    problems.push(`${levels.length} mip levels are too many for ${longest} texels`);
  }
  levels.forEach(({ levelData, uncompressedByteLength }, k) => {
    if (k > 0 && levelData.byteOffset >= levels[k - 1].levelData.byteOffset) {
      problems.push(`level ${k} does not lie before level ${k - 1}`);
    }
    if (texelBytes !== undefined) {
      const texels = [pixelWidth, pixelHeight, pixelDepth]
        .map((n) => Math.max(1, n >> k))
        .reduce((a, b) => a * b);
      if (uncompressedByteLength !== texels * texelBytes) {
        problems.push(`level ${k}: ${uncompressedByteLength} bytes for ${texels} texels`);
      }
    }
    if (texture.supercompressionScheme === KHR_SUPERCOMPRESSION_ZSTD) {
      const inflated = zstd.decode(levelData, uncompressedByteLength);
      if (inflated.length !== uncompressedByteLength) {
        problems.push(`level ${k} inflates to ${inflated.length} bytes`);
      }
    }
  });
}

/** Checks a texture; `transfer` is the transfer function that a mesh's texture must have, or null for a volume. */
function checkTexture(bytes, transfer) {
  const problems = [];
  const texture = read(bytes);
  const [descriptor] = texture.dataFormatDescriptor;
  if (!texture.keyValue.KTXwriter) problems.push("no KTXwriter");
  checkLevels(texture, problems);
  if (transfer !== null) {
    if (![KHR_DF_MODEL_ETC1S, KHR_DF_MODEL_UASTC].includes(descriptor.colorModel)) {
      problems.push(`colour model ${descriptor.colorModel} is not Basis Universal`);
    }
    if (descriptor.transferFunction !== transfer) {
      problems.push(`transfer function ${descriptor.transferFunction}, expected ${transfer}`);
    }
    if (texture.pixelWidth % 4 || texture.pixelHeight % 4) {
      problems.push(`${texture.pixelWidth} x ${texture.pixelHeight} is no multiple of 4`);
    }
  } else if (!TEXEL_BYTES.has(texture.vkFormat)) {
    problems.push(`vkFormat ${texture.vkFormat} is none that a bundle holds`);
  } else if (descriptor.samples.length !== TEXEL_BYTES.get(texture.vkFormat)) {
    problems.push(`${descriptor.samples.length} samples do not fit vkFormat ${texture.vkFormat}`);
  }
  return problems;
}

/** Returns the images that glTF reads as sRGB; normals and occlusion are linear. */
function imagesOfColor({ materials = [], textures = [] }) {
  const used = materials.flatMap(({ pbrMetallicRoughness = {}, emissiveTexture }) =>
    [pbrMetallicRoughness.baseColorTexture, emissiveTexture].filter(Boolean),
  );
  return new Set(used.map(({ index }) => textures[index].extensions.KHR_texture_basisu.source));
}

function check(path) {
  try {
    const bytes = new Uint8Array(readFileSync(path));
    if (!path.endsWith(".glb")) return checkTexture(bytes, null);
    const { document, binary } = unpackGlb(bytes);
    const colors = imagesOfColor(document);
    return (document.images ?? []).flatMap(({ mimeType, bufferView }, i) => {
      if (mimeType !== "image/ktx2") return [];
      const transfer = colors.has(i) ? KHR_DF_TRANSFER_SRGB : KHR_DF_TRANSFER_LINEAR;
      return checkTexture(bytesOf(document.bufferViews[bufferView], binary), transfer);
    });
  } catch (error) {
    return [String(error.message ?? error)];
  }
}

const zstd = new ZSTDDecoder();
await zstd.init();
const paths = await json(process.stdin);
process.stdout.write(JSON.stringify(paths.map((path) => ({ path, problems: check(path) }))));
