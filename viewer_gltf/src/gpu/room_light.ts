/**
 * The light of the room, the same for surfaces and for volumes: two lamps and a sky. Each as the light that a white
 * surface sends on where it faces the lamp: linear RGB. Pure.
 */
import type { Rgb } from "../math/color";
import type { Vec3 } from "../math/vec3";

/** A lamp that is far away. */
export type FarLamp = Readonly<{
  light: Rgb;
  /** The direction to it, of any length. */
  towards: Vec3;
}>;

export type RoomLight = Readonly<{
  key: FarLamp;
  fill: FarLamp;
  sky: Rgb;
  /** Light from below: a dark room's floor still keeps a colour from turning black. */
  ground: Rgb;
  /** The directions to the lamps are in the axes of the eye, over whose shoulder they hang, or of the specimen. */
  standsWith: "eye" | "specimen";
}>;

/** The viewer's own light: a lamp over the viewer's left shoulder, and a weaker one from the right. */
export const OWN_LIGHT: RoomLight = {
  key: { light: [0.66, 0.62, 0.56], towards: [-1.2, 1.6, 2.5] },
  fill: { light: [0.08, 0.1, 0.14], towards: [1.8, -0.4, 1.8] },
  sky: [0.33, 0.34, 0.37],
  ground: [0.13, 0.125, 0.12],
  standsWith: "eye",
};

/** The most of the lamp's light that a boundary in a volume throws back: as surfaces of roughness 0.5 do. */
export const GLOSS = 0.1;

/** Lamps as one, from where most of their light comes; dark where there are none. */
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
