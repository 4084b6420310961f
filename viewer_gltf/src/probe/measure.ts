/** Computes measurements and writes their texts: the distance of two points, a channel's value at a point. Pure. */
import { Matrix4, Vector3 } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Size3 } from "../bundle/ktx2";
import { distanceText } from "../math/length_text";
import type { Vec3 } from "../math/vec3";
import { angleOf, lengthOf } from "../state/measurements";
import type { MeasureKind } from "../state/parameters/tools";
import { textureCorners } from "../voxels/texture_space";

/** One mip level: texels along x, y, z and their bytes, x fastest. */
export type VolumeLevel = Readonly<{
  size: Size3;
  texels: Uint8Array;
  /** Bytes of a texel and index of the channel in it if channels are interleaved; otherwise 1 and 0. */
  stride?: number;
  channel?: number;
}>;
/** The values of the source that are 0 and 255 in the volumes. */
export type Window = readonly [number, number];

/** Tolerance at the edge of a tile, as a share of the box. Points on the edge count as inside despite rounding. */
const RIM = 1e-6;

/** Returns a measurement's text: a distance, an angle, or a line's length and number of points. */
export function measurementText(kind: MeasureKind, points: readonly Vec3[]): string {
  if (kind === "angle") {
    const angle = angleOf(points);
    return angle === null ? "two points coincide" : `${angle.toFixed(1)}°`;
  }
  const length = distanceText(lengthOf(points));
  return kind === "line" ? `${length}, ${points.length} points` : length;
}

/**
 * Returns the channel's value at a point (um, world) on the source's scale; null outside the tile. The value is
 * trilinear between texels, as in the ray march.
 *
 * @param level any mip level of the tile's texture, since all of them cover the same box
 */
export function valueAt(
  volume: TileVolume,
  level: VolumeLevel,
  window: Window,
  point_um: Vec3,
): number | null {
  const shares = sharesIn(volume, point_um);
  if (shares === null) return null;
  const { low, high } = textureCorners(volume);
  const [from, to] = [low.toArray(), high.toArray()];
  const at = shares.map(
    (share, axis) => (from[axis] + (to[axis] - from[axis]) * share) * level.size[axis] - 0.5,
  );
  const [start, end] = window;
  return start + ((end - start) * trilinear(level, at[0], at[1], at[2])) / 255;
}

/** Returns the centre of the voxel that contains a point (um, world), in the volume's own um; null outside. */
export function voxelAt(volume: TileVolume, point_um: Vec3): Vec3 | null {
  const { min, max } = volume.bounds_um;
  const centre = sharesIn(volume, point_um)?.map((share, axis) => {
    const cells = volume.size[axis] - 2 * volume.apron - 1;
    const index = Math.min(Math.max(Math.round(share * cells), 0), cells);
    return cells > 0 ? min[axis] + ((max[axis] - min[axis]) * index) / cells : min[axis];
  });
  return centre === undefined ? null : [centre[0], centre[1], centre[2]];
}

/**
 * Returns where a point (um, world) lies along the edges of a volume's box: shares 0 to 1 along x,
 * y, z; null outside.
 */
function sharesIn({ bounds_um, matrix }: TileVolume, point_um: Vec3): number[] | null {
  const { min, max } = bounds_um;
  const toTile = new Matrix4().fromArray(matrix).invert();
  const p = new Vector3(...point_um).applyMatrix4(toTile).toArray();
  const shares = p.map((place, axis) => {
    const edge = max[axis] - min[axis];
    return edge > 0 ? (place - min[axis]) / edge : place === min[axis] ? 0 : -1;
  });
  return shares.every((share) => share >= -RIM && share <= 1 + RIM) ? shares : null;
}

/** Writes a measured value with all digits, and its unit. */
export function measuredText(value: number, unit = ""): string {
  return `${value} ${unit}`.trim();
}

/** Returns the unit of the source's values: Hounsfield units for CT, otherwise "". */
export function unitOf({ specimen }: Pick<Manifest, "specimen">): string {
  return specimen.modality === "CT" ? "HU" : "";
}

/** Writes a value with the digits that 8 bits of the window resolve, and its unit. */
export function valueText(value: number, [start, end]: Window, unit = ""): string {
  const step = Math.abs(end - start) / 255;
  const decimals = step > 0 ? Math.max(0, -Math.floor(Math.log10(step))) : 0;
  return `${value.toFixed(Math.min(decimals, 100))} ${unit}`.trim();
}

/** Returns the value at a place in texels, where 0 is the centre of the first; clamped to the edge as on the GPU. */
function trilinear(level: VolumeLevel, x: number, y: number, z: number): number {
  const { texels, stride = 1, channel = 0 } = level;
  const [nx, ny, nz] = level.size;
  const clamp = (v: number, n: number) => Math.min(Math.max(v, 0), n - 1);
  const [cx, cy, cz] = [clamp(x, nx), clamp(y, ny), clamp(z, nz)];
  const [i, j, k] = [Math.floor(cx), Math.floor(cy), Math.floor(cz)];
  const [fx, fy, fz] = [cx - i, cy - j, cz - k];
  const texel = (di: number, dj: number, dk: number) => {
    const row = Math.min(k + dk, nz - 1) * ny + Math.min(j + dj, ny - 1);
    return texels[(row * nx + Math.min(i + di, nx - 1)) * stride + channel];
  };
  const row = (dj: number, dk: number) => texel(0, dj, dk) * (1 - fx) + texel(1, dj, dk) * fx;
  const plane = (dk: number) => row(0, dk) * (1 - fy) + row(1, dk) * fy;
  return plane(0) * (1 - fz) + plane(1) * fz;
}
