/**
 * The light of the scene, the same for surfaces and volumes: two lamps and a sky. Each is given as
 * the light that a white surface facing it reflects, in linear RGB.
 */
import type { Rgb } from "../math/color";
import type { Vec3 } from "../math/vec3";

/** A lamp at infinite distance. */
export type FarLamp = Readonly<{
  light: Rgb;
  /** The direction towards the lamp, of any length. */
  towards: Vec3;
}>;

export type SceneLight = Readonly<{
  key: FarLamp;
  fill: FarLamp;
  sky: Rgb;
  /** Light from below, which keeps downward faces from turning black. */
  ground: Rgb;
  /**
   * Whether the lamps' directions are in the axes of the eye, over whose shoulders they hang, or of
   * the specimen.
   */
  standsWith: "eye" | "specimen";
}>;

/**
 * The viewer's own light: a lamp over the user's left shoulder, and a weaker one from the right.
 */
export const OWN_LIGHT: SceneLight = {
  key: { light: [0.66, 0.62, 0.56], towards: [-1.2, 1.6, 2.5] },
  fill: { light: [0.08, 0.1, 0.14], towards: [1.8, -0.4, 1.8] },
  sky: [0.33, 0.34, 0.37],
  ground: [0.13, 0.125, 0.12],
  standsWith: "eye",
};

/**
 * Largest share of the key light that a boundary in a volume reflects: like surfaces of roughness
 * 0.5.
 */
export const GLOSS = 0.1;

/**
 * Combines lamps into one, in the direction from which most of their light comes; dark without
 * lamps.
 */
export function asOneLamp(
  lamps: readonly Readonly<{ color: Rgb; strength: number; towards: Vec3 }>[],
): FarLamp {
  const towards: [number, number, number] = [0, 0, 0];
  const light: [number, number, number] = [0, 0, 0];
  for (const lamp of lamps) {
    const length = Math.hypot(...lamp.towards) || 1;
    for (const k of [0, 1, 2]) {
      towards[k] += (lamp.towards[k] / length) * lamp.strength;
      light[k] += lamp.color[k] * lamp.strength;
    }
  }
  return { light, towards: Math.hypot(...towards) === 0 ? [0, 0, 1] : towards };
}
