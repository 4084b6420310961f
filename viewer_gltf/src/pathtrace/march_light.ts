/**
 * Approximates the lamps and the environment of path tracing for the ray-marched frame that stands in for it. Ray
 * marching supports two lamps without shadows, a sky and a ground. LightProbe then matches the brightness.
 */
import type { Matrix4, Vector3 } from "three";
import { asOneLamp, GLOSS } from "../gpu/scene_light";
import type { Rgb } from "../math/color";
import { type Lamp, MEDIUM_NUMBERS, type TraceSettings } from "../state/path_trace_settings";
import type { MarchLight } from "../voxels/march_frame";
import type { EnvironmentTables } from "./environment_sampling";

/** Mean radiance of the upper and of the lower half of the environment. */
export type Hemispheres = Readonly<{ sky: Rgb; ground: Rgb }>;

export function hemispheresOf({ width, height, light }: EnvironmentTables): Hemispheres {
  const sums = [
    [0, 0, 0],
    [0, 0, 0],
  ];
  const weights = [0, 0];
  for (let i = 0; i < width * height; i++) {
    const row = Math.floor(i / width);
    const [top, bottom] = [row, row + 1].map((v) => Math.cos((v / height) * Math.PI));
    // a row of the map may cross the horizon; these are its parts above and below
    const parts = [Math.max(top, 0) - Math.max(bottom, 0), Math.min(top, 0) - Math.min(bottom, 0)];
    parts.forEach((part, half) => {
      weights[half] += part;
      for (let k = 0; k < 3; k++) sums[half][k] += part * light[4 * i + k];
    });
  }
  const mean = (half: number): Rgb => {
    const [r, g, b] = sums[half].map((v) => v / weights[half]);
    return [r, g, b];
  };
  return { sky: mean(0), ground: mean(1) };
}

/** @param toEye rotation from the specimen's axes to the eye's */
export function lightMarch(
  march: MarchLight,
  { lamps, environmentLight, shine }: TraceSettings,
  { sky, ground }: Hemispheres,
  toEye: Matrix4,
): void {
  march.uSkyLight.value.set(...sky).multiplyScalar(environmentLight);
  march.uGroundLight.value.set(...ground).multiplyScalar(environmentLight);
  march.uGloss.value = (GLOSS * shine) / MEDIUM_NUMBERS.shine.start;
  const lit = lamps.filter(({ isOn, strength }) => isOn && strength > 0);
  const [key, ...others] = lit.sort((a, b) => b.strength - a.strength);
  place(march.uLight.value, march.uKeyLight.value, key === undefined ? [] : [key], toEye);
  place(march.uFill.value, march.uFillLight.value, others, toEye);
}

function place(towards: Vector3, light: Vector3, lamps: readonly Lamp[], toEye: Matrix4): void {
  const one = asOneLamp(lamps.map((lamp) => ({ ...lamp, towards: [lamp.x, lamp.y, lamp.z] })));
  towards.set(...one.towards).transformDirection(toEye);
  light.set(...one.light);
}
