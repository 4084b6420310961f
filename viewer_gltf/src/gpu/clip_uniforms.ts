/** The specimen after the cuts, in the space of one box of texels. */
import { Matrix4, Vector3, type Vector4 } from "three";

/** Of the specimen, um: what is left of it. `plane`: unit normal and offset. */
export type MarchClip = Readonly<{ min: Vector3; max: Vector3; plane: Vector4 }>;

export type ClipUniforms = Readonly<{
  uClipLow: { value: Vector3 };
  uClipHigh: { value: Vector3 };
  /** xyz unit normal, w offset. */
  uClipPlane: { value: Vector4 };
}>;

const corner = new Vector3();
const transposed = new Matrix4();

/** The box, of another space, round one of the world. */
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
    corner.set(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z);
    corner.applyMatrix4(toOther);
    intoMin.min(corner);
    intoMax.max(corner);
  }
}

/** @param toWorld from the box to the specimen's world; `toBox` is its inverse */
export function clipInto(
  { min, max, plane }: MarchClip,
  toWorld: Matrix4,
  toBox: Matrix4,
  { uClipLow, uClipHigh, uClipPlane }: ClipUniforms,
): void {
  boxAround(min, max, toBox, uClipLow.value, uClipHigh.value);
  // a plane n . p <= w of the world is n' . p' <= w' of the box
  const value = uClipPlane.value.set(plane.x, plane.y, plane.z, -plane.w);
  value.applyMatrix4(transposed.copy(toWorld).transpose());
  value.w *= -1;
}
