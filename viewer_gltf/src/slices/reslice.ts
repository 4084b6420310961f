/**
 * Resamples the volumes of the tiles on a plane. The map from pixels to texels is affine, so a row of pixels is a
 * straight line through each texture. Only the part of that line inside the texture is sampled. Pure.
 */
import { Matrix4, Vector3 } from "three";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Rgb } from "../math/color";
import type { VolumeLevel } from "../probe/measure";
import { textureCorners } from "../voxels/texture_space";
import type { SliceFrame } from "./slice_frame";

/** One tile's texels of a channel. */
export type TexelBlock = Readonly<{ volume: TileVolume; level: VolumeLevel }>;

/** Size of an image in pixels. */
export type Size = Readonly<{ width: number; height: number }>;

/** Returns the size of an image with square pixels and `longest` pixels along its longer edge. */
export function sizeOf({ half }: SliceFrame, longest: number): Size {
  const most = Math.max(half[0], half[1]);
  const along = (edge: number) => Math.max(1, Math.round((longest * edge) / most));
  return { width: along(half[0]), height: along(half[1]) };
}

/** Returns the intensities of one channel, 0..255, row by row from the top; NaN: the pixel lies in no tile. */
export function reslice(
  blocks: readonly TexelBlock[],
  frame: SliceFrame,
  { width, height }: Size,
): Float32Array {
  const values = new Float32Array(width * height).fill(Number.NaN);
  const { origin, right, up, half } = frame;
  const across = new Vector3(...right).multiplyScalar((2 * half[0]) / width);
  const down = new Vector3(...up).multiplyScalar((-2 * half[1]) / height);
  const first = new Vector3(...origin)
    .addScaledVector(across, (1 - width) / 2)
    .addScaledVector(down, (1 - height) / 2);
  for (const { volume, level } of blocks) {
    const toTexels = texelMatrix(volume, level);
    const start = first.clone().applyMatrix4(toTexels.matrix);
    const origin0 = new Vector3().applyMatrix4(toTexels.matrix);
    const step = across.clone().applyMatrix4(toTexels.matrix).sub(origin0);
    const line = down.clone().applyMatrix4(toTexels.matrix).sub(origin0);
    for (let row = 0; row < height; row++) {
      const at = start.clone().addScaledVector(line, row);
      sampleRow(values, row * width, width, at, step, toTexels, level);
    }
  }
  return values;
}

type TexelSpace = Readonly<{ matrix: Matrix4; low: Vector3; high: Vector3 }>;

/**
 * Returns the matrix from um to texels, where 0 is the centre of the first texel, and the box of the tile in texels,
 * without the apron.
 */
function texelMatrix(volume: TileVolume, { size }: VolumeLevel): TexelSpace {
  const { min, max } = volume.bounds_um;
  const { low, high } = textureCorners(volume);
  const texels = new Vector3(...size);
  const half = new Vector3(0.5, 0.5, 0.5);
  const from = low.multiply(texels).sub(half);
  const to = high.multiply(texels).sub(half);
  const edge = new Vector3(...max).sub(new Vector3(...min));
  const per = (i: 0 | 1 | 2) => {
    const length = edge.getComponent(i);
    return length > 0 ? (to.getComponent(i) - from.getComponent(i)) / length : 0;
  };
  const matrix = new Matrix4()
    .makeTranslation(from)
    .multiply(new Matrix4().makeScale(per(0), per(1), per(2)))
    .multiply(new Matrix4().makeTranslation(-min[0], -min[1], -min[2]))
    .multiply(new Matrix4().fromArray(volume.matrix).invert());
  return { matrix, low: from.clone().min(to), high: from.clone().max(to) };
}

/** Tolerance at a tile's edge, texels. Neighbours share the edge, and rounding must not leave a gap between them. */
const RIM = 1e-3;

/**
 * Samples one row of an image trilinearly. The first pixel is at the texel position `at`, and each
 * next one is farther by the vector `step`.
 */
function sampleRow(
  values: Float32Array,
  offset: number,
  width: number,
  at: Vector3,
  step: Vector3,
  { low, high }: TexelSpace,
  { size, texels, stride = 1, channel = 0 }: VolumeLevel,
): void {
  let from = 0;
  let to = width - 1;
  for (const axis of [0, 1, 2] as const) {
    const [p, d] = [at.getComponent(axis), step.getComponent(axis)];
    const [least, most] = [low.getComponent(axis) - RIM, high.getComponent(axis) + RIM];
    if (Math.abs(d) < 1e-12) {
      if (p < least || p > most) return;
      continue;
    }
    const [a, b] = [(least - p) / d, (most - p) / d];
    from = Math.max(from, Math.ceil(Math.min(a, b)));
    to = Math.min(to, Math.floor(Math.max(a, b)));
  }
  const [nx, ny, nz] = size;
  for (let i = from; i <= to; i++) {
    const x = Math.min(Math.max(at.x + i * step.x, 0), nx - 1);
    const y = Math.min(Math.max(at.y + i * step.y, 0), ny - 1);
    const z = Math.min(Math.max(at.z + i * step.z, 0), nz - 1);
    const [ix, iy, iz] = [Math.floor(x), Math.floor(y), Math.floor(z)];
    const [fx, fy, fz] = [x - ix, y - iy, z - iz];
    const jx = Math.min(ix + 1, nx - 1);
    const jy = Math.min(iy + 1, ny - 1);
    const jz = Math.min(iz + 1, nz - 1);
    const row = (ry: number, rz: number) => {
      const base = (rz * ny + ry) * nx;
      const left = texels[(base + ix) * stride + channel];
      return left + fx * (texels[(base + jx) * stride + channel] - left);
    };
    const near = row(iy, iz) * (1 - fy) + row(jy, iz) * fy;
    const far = fz === 0 ? near : row(iy, jz) * (1 - fy) + row(jy, jz) * fy;
    values[offset + i] = near + fz * (far - near);
  }
}

/** Appearance of a channel: the intensities, 0..1, that are shown from dark to bright, and its colour, linear RGB. */
export type SliceLook = Readonly<{ window: readonly [number, number]; color: Rgb }>;

/** Colour of a single channel: an image of one channel is easiest to read in grey. */
export const GREY: Rgb = [1, 1, 1];

/**
 * Adds up the channels' colours into sRGB pixels, which are opaque where any channel has a value. The sum is taken
 * over the encoded bytes, so that a pixel's brightness on screen is proportional to the intensity.
 */
export function compose(
  layers: readonly Readonly<{ values: Float32Array; look: SliceLook }>[],
  pixels: Uint8ClampedArray,
): void {
  pixels.fill(0);
  for (const { values, look } of layers) {
    const [low, high] = look.window;
    const [r, g, b] = look.color.map((part) => 255 * encoded(part));
    const factor = 1 / (255 * Math.max(high - low, 1e-6));
    for (let i = 0; i < values.length; i++) {
      const value = values[i];
      if (Number.isNaN(value)) continue;
      const share = Math.min(1, Math.max(0, value * factor - low * 255 * factor));
      pixels[4 * i] += r * share;
      pixels[4 * i + 1] += g * share;
      pixels[4 * i + 2] += b * share;
      pixels[4 * i + 3] = 255;
    }
  }
}

/** Encodes a linear value as sRGB (IEC 61966-2-1). */
function encoded(linear: number): number {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
}
