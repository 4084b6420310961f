/** The light of pixels, and the light of the scene on surfaces that face the eye. */
import { type FarLamp, OWN_LIGHT } from "../../../src/gpu/scene_light";
import { fromHex } from "../../../src/math/color";
import type { Vec3 } from "../../../src/math/vec3";
import { FIELD_OF_VIEW_RAD } from "./camera";
import type { Picture } from "./picture";

const BACKGROUND_RED = 11;
/** Light of a homogeneous volume relative to that of a surface that faces the eye, as in chunks/shade. */
export const SCATTERED = 1.2;

/** Returns the linear light, 0..1, of a byte of sRGB. */
export function lightOf(byte: number): number {
  return fromHex(`#${byte.toString(16).padStart(2, "0")}0000`)[0];
}

/** Returns the red light of a pixel above that of the background, 0..1. */
export function lightAt(picture: Picture, { x, y }: Readonly<{ x: number; y: number }>): number {
  return lightOf(picture.at(x, y)[0]) - lightOf(BACKGROUND_RED);
}

/** Returns the red light of a white surface that faces the eye, at a pixel of the start view. */
export function lightFacing(
  { width, height }: Picture,
  { x, y }: Readonly<{ x: number; y: number }>,
): number {
  const slope = Math.tan(FIELD_OF_VIEW_RAD / 2) / (height / 2);
  const normal = unit([(width / 2 - x) * slope, (y - height / 2) * slope, 1]);
  const { key, fill, sky: above, ground: below } = OWN_LIGHT;
  const lamp = ({ light, towards }: FarLamp) => light[0] * Math.max(0, dot(normal, unit(towards)));
  const sky = 0.5 + 0.5 * normal[1];
  return lamp(key) + lamp(fill) + below[0] * (1 - sky) + above[0] * sky;
}

function unit(v: Vec3): Vec3 {
  const length = Math.hypot(...v);
  return [v[0] / length, v[1] / length, v[2] / length];
}

function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
