/** The clip of the specimen, in the space of one box of texels. */
import { Matrix4, Vector3, Vector4 } from "three";

/** The number of planes that bound the corner in front of the slices. */
export const CORNER_PLANES = 3;

/**
 * The kept part of the specimen, um. `plane`: unit normal and offset. `corner`: planes; points
 * beyond all of them are removed.
 */
export type MarchClip = Readonly<{
  min: Vector3;
  max: Vector3;
  plane: Vector4;
  corner: readonly Vector4[];
}>;

/** Planes that remove nothing: three.js initialises them to 0, 0, 0, 1. */
export function noCorner(): Vector4[] {
  return Array.from({ length: CORNER_PLANES }, () => new Vector4());
}

export type ClipUniforms = Readonly<{
  uClipLow: { value: Vector3 };
  uClipHigh: { value: Vector3 };
  /** xyz unit normal, w offset. */
  uClipPlane: { value: Vector4 };
  uCorner: { value: readonly Vector4[] };
}>;

const vertex = new Vector3();
const transposed = new Matrix4();

/** The box, in another space, around a box of the world. */
export function boxAround(
  min: Vector3,
  max: Vector3,
  toOther: Matrix4,
  intoMin: Vector3,
  intoMax: Vector3,
): void {
  intoMin.setScalar(Number.POSITIVE_INFINITY);
  intoMax.setScalar(Number.NEGATIVE_INFINITY);
  for (let i = 0; i < 8; i++) {
    vertex.set(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z);
    vertex.applyMatrix4(toOther);
    intoMin.min(vertex);
    intoMax.max(vertex);
  }
}

/** @param toWorld transform from the box to the specimen's world; `toBox` is its inverse */
export function clipInto(
  { min, max, plane, corner }: MarchClip,
  toWorld: Matrix4,
  toBox: Matrix4,
  { uClipLow, uClipHigh, uClipPlane, uCorner }: ClipUniforms,
): void {
  boxAround(min, max, toBox, uClipLow.value, uClipHigh.value);
  transposed.copy(toWorld).transpose();
  planeInto(plane, uClipPlane.value);
  corner.forEach((each, i) => {
    planeInto(each, uCorner.value[i]);
  });
}

/** Transforms a plane n . p <= w of the world into n' . p' <= w' of the box. */
function planeInto({ x, y, z, w }: Vector4, into: Vector4): void {
  into.set(x, y, z, -w).applyMatrix4(transposed);
  into.w *= -1;
}
