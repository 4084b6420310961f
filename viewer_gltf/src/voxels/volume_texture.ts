import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  RedFormat,
  RGBAFormat,
  RGFormat,
  UnsignedByteType,
} from "three";
import type { Size3 } from "../bundle/ktx2";

/** Bytes of a texel on the GPU. */
export function stride(channels: number): number {
  return channels <= 2 ? channels : 4;
}

/**
 * @param texels channels interleaved, `stride` bytes each, x fastest; released when the GPU has
 *   them
 */
export function volumeTexture(
  texels: Uint8Array<ArrayBuffer>,
  size: Size3,
  channels: number,
): Data3DTexture {
  const texture = new Data3DTexture(texels, ...size);
  texture.format = [RedFormat, RGFormat, RGBAFormat, RGBAFormat][channels - 1];
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  texture.onUpdate = () => {
    texture.image.data = null;
    texture.onUpdate = null;
  };
  return texture;
}
