/** Places of points in the start view, by the viewer's own rules of placement. */
import type { Manifest } from "../../../src/bundle/generated/bundle";
import { framingDistance, place } from "../../../src/render/placement";

export const FIELD_OF_VIEW_RAD = (40 * Math.PI) / 180;

/**
 * Side from which the eye sees the specimen: the front at the start (towards +z), or the left after
 * a quarter turn.
 */
export type Side = "front" | "left";

/**
 * Returns the pixel of a point (um, world) in a stage of a size, and the cosine between its ray and
 * the axis.
 */
export function project(
  point: readonly [number, number, number],
  bounds: Manifest["specimen"]["bounds_um"],
  width: number,
  height: number,
  side: Side = "front",
): { x: number; y: number; cosine: number } {
  const { scale, center, size } = place(bounds);
  const distance = framingDistance(size, FIELD_OF_VIEW_RAD, width / height);
  const p = point.map((v, i) => (v - center[i]) * scale);
  const [x, y, z] = side === "front" ? p : [p[2], p[1], -p[0]];
  const depth = distance - z;
  const pixels = height / 2 / Math.tan(FIELD_OF_VIEW_RAD / 2) / depth;
  return {
    x: width / 2 + x * pixels,
    y: height / 2 - y * pixels,
    cosine: depth / Math.hypot(x, y, depth),
  };
}
