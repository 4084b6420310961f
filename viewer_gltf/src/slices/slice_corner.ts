/** The corner of the specimen in front of the three slices, which is cut away because it would hide them. um. Pure. */
import type { ClipPlane } from "../math/clip";
import { dot, type Vec3 } from "../math/vec3";
import { negated, type SliceFrame } from "./slice_frame";

/**
 * Distance between the cut corner and the slices, as a share of half the image's longer edge. Rounding then never
 * cuts the slices themselves.
 */
const BEFORE = 1e-5;
/**
 * Distance from a slice, as a share of half the image's longer edge, within which a passing eye
 * does not switch corners yet.
 */
const SWITCH_DISTANCE = 0.02;

/**
 * Returns the planes that bound the corner between the slices and an eye. Their normals lead to the eye.
 *
 * @param before result of the last call; empty at the first one
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
    const side = Math.abs(away) < SWITCH_DISTANCE * reach && last !== 0 ? last : away;
    const towards = side < 0 ? negated(normal) : normal;
    return { normal: towards, offset_um: dot(towards, origin) + BEFORE * reach };
  });
}
