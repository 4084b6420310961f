/** The corner before three slices, which would hide them. um, world. Pure. */
import type { ClipPlane } from "../math/clip";
import { dot, type Vec3 } from "../math/vec3";
import { negated, type SliceFrame } from "./slice_frame";

/** Distance from the planes to the corner's end, by half a picture's longer edge: rounding stays outside. */
const BEFORE = 1e-5;
/** Distance by the same edge: an eye that is nearer to a plane leaves the corner on its side. */
const LINGERS = 0.02;

/**
 * The corner between the planes that faces an eye: what it holds hides them. Normals lead to the eye.
 *
 * @param before the last one
 */
export function cornerTowards(
  eye: Vec3,
  frames: readonly SliceFrame[],
  before: readonly ClipPlane[],
): readonly ClipPlane[] {
  return frames.map(({ origin, normal, half }, i) => {
    const reach = Math.max(...half);
    const away = dot(normal, eye) - dot(normal, origin);
    const last = before[i] === undefined ? 0 : dot(before[i].normal, normal);
    const side = Math.abs(away) < LINGERS * reach && last !== 0 ? last : away;
    const towards = side < 0 ? negated(normal) : normal;
    return { normal: towards, offset_um: dot(towards, origin) + BEFORE * reach };
  });
}
