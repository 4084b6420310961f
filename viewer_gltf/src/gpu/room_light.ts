/**
 * The light of the room, the same for surfaces and for volumes: a lamp over the viewer's left
 * shoulder, a weaker one from the right, and a sky. Each as the light that a white surface sends on
 * where it faces the lamp: linear RGB.
 */
import type { Rgb } from "../math/color";
import type { Vec3 } from "../math/vec3";

export const KEY: Rgb = [0.66, 0.62, 0.56];
export const FILL: Rgb = [0.08, 0.1, 0.14];
export const SKY: Rgb = [0.33, 0.34, 0.37];
/** Light from below: a dark room's floor still keeps a colour from turning black. */
export const GROUND: Rgb = [0.13, 0.125, 0.12];

/** The most of the lamp's light that a boundary in a volume throws back: as surfaces of roughness 0.5 do. */
export const GLOSS = 0.1;

/** Where the lamps hang, and where they shine: metres, in the axes of the eye. */
export const KEY_AT: Vec3 = [-1.2, 1.6, 1.5];
export const FILL_AT: Vec3 = [1.8, -0.4, 0.8];
export const SHINES_AT: Vec3 = [0, 0, -1];

/** Towards a lamp, from where it shines. */
export function towards([x, y, z]: Vec3): Vec3 {
  return [x - SHINES_AT[0], y - SHINES_AT[1], z - SHINES_AT[2]];
}
