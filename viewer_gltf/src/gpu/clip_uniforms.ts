/** The specimen after the cuts, in the space of one box of texels. */
import { Matrix4, Vector3, Vector4 } from "three";

/** The planes that bound the corner before the slices. */
export const CORNER_PLANES = 3;
/** A plane beyond which nothing lies. */
export const NOWHERE = [0, 0, 0, 1] as const;

/**
 * Of the specimen, um: what is left of it. `plane`: unit normal and offset. `corner`: as many such planes as
 * bound one; what lies beyond all of them is gone.
 */
export type MarchClip = Readonly<{
  min: Vector3;
  max: Vector3;
  plane: Vector4;
  corner: readonly Vector4[];
}>;

/** Nothing is cut by them. */
export function noCorner(): Vector4[] {
  return Array.from({ length: CORNER_PLANES }, () => new Vector4(...NOWHERE));
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
    vertex.set(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z);
    vertex.applyMatrix4(toOther);
    intoMin.min(vertex);
    intoMax.max(vertex);
  }
}

/** @param toWorld from the box to the specimen's world; `toBox` is its inverse */
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

/** A plane n . p <= w of the world is n' . p' <= w' of the box. */
function planeInto({ x, y, z, w }: Vector4, into: Vector4): void {
  into.set(x, y, z, -w).applyMatrix4(transposed);
  into.w *= -1;
}
