/**
 * A plane cut through the volumes of the tiles, as a picture. The map from pixels to texels is affine, so
 * a row of pixels is a straight line through each texture, of which only the part inside is walked. Pure.
 */
import { Matrix4, Vector3 } from "three";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Rgb } from "../math/color";
import type { VolumeLevel } from "../probe/measure";
import { textureCorners } from "../voxels/texture_space";
import type { SliceFrame } from "./slice_frame";

/** One tile's texels of a channel. */
export type TexelBlock = Readonly<{ volume: TileVolume; level: VolumeLevel }>;

/** Pixels of a picture's rows, and how many rows. */
export type Size = Readonly<{ width: number; height: number }>;

/** So many pixels along the longer edge; the pixels are square. */
export function sizeOf({ half }: SliceFrame, longest: number): Size {
  const most = Math.max(half[0], half[1]);
  const along = (edge: number) => Math.max(1, Math.round((longest * edge) / most));
  return { width: along(half[0]), height: along(half[1]) };
}

/** Intensities 0..255 of one channel, row by row from the top; NaN: outside of all tiles. */
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
      walk(values, row * width, width, at, step, toTexels, level);
    }
  }
  return values;
}

type TexelSpace = Readonly<{ matrix: Matrix4; low: Vector3; high: Vector3 }>;

/** From the world, um, to texels, 0 the centre of the first; the box of what is the tile's own. */
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

/** Tolerance at a tile's rim, texels: neighbours share it, and rounding must leave no line between. */
const RIM = 1e-3;

function walk(
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

/** How a channel shows: the part of its intensities, 0..1, that goes from dark to bright; linear RGB. */
export type SliceLook = Readonly<{ window: readonly [number, number]; color: Rgb }>;

/** Grey, as a picture of one channel is read best. */
export const GREY: Rgb = [1, 1, 1];

/**
 * Channels added up as lights, as sRGB bytes; opaque where any of them has a value. One channel is as
 * bright as its values are, on the screen's own scale; so are several in their colours.
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

/** IEC 61966-2-1. */
function encoded(linear: number): number {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
}
