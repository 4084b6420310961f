/**
 * The light that a layer of the stage gives the specimen, for path tracing and for all other
 * frames. Pure.
 */
import type { Lights, Manifest, StageLamp } from "../bundle/generated/bundle";
import { asOneLamp, OWN_LIGHT, type SceneLight } from "../gpu/scene_light";
import type { Vec3 } from "../math/vec3";
import { LAMP_REACH, type Lamp, START_TRACE, type TraceSettings } from "./path_trace_settings";

type Bounds = Manifest["specimen"]["bounds_um"];

const DARK = [0, 0, 0] as const;

/** Returns the light of all frames but the path-traced ones. */
export function sceneLightOf({ lights, specimen: { bounds_um } }: Manifest): SceneLight {
  if (lights === undefined) return OWN_LIGHT;
  const [key, ...others] = lights.lamps.map((lamp) => ({
    ...lamp,
    towards: offsetOf(lamp, bounds_um),
  }));
  return {
    key: asOneLamp(key === undefined ? [] : [key]),
    fill: asOneLamp(others),
    sky: lights.room?.sky ?? DARK,
    ground: lights.room?.ground ?? DARK,
    standsWith: "specimen",
  };
}

/**
 * Returns the opening settings of path tracing. The author of a stage has set its light for
 * surfaces, so the exposure is 0 stops.
 */
export function traceLitBy(lights: Lights | undefined, bounds: Bounds): TraceSettings {
  if (lights === undefined) return START_TRACE;
  const off = START_TRACE.lamps.map((lamp): Lamp => ({ ...lamp, isOn: false }));
  const lamps = off.map((lamp, i) => {
    const given = lights.lamps[i];
    return given === undefined ? lamp : lampOf(given, bounds);
  });
  return {
    ...START_TRACE,
    lamps,
    exposure: 0,
    environment: lights.room === undefined ? START_TRACE.environment : "stage",
    environmentLight: lights.room === undefined ? 0 : 1,
  };
}

/**
 * Converts a lamp of the stage. A lamp beyond the reach of a hand is moved nearer, and stays as
 * bright in the middle.
 */
function lampOf(lamp: StageLamp, bounds: Bounds): Lamp {
  const offset = offsetOf(lamp, bounds);
  const largest = Math.max(...offset.map(Math.abs));
  const share = lamp.position_um === null || largest > LAMP_REACH ? LAMP_REACH / largest : 1;
  const [x, y, z] = offset.map((v) => v * share);
  return { isOn: true, x, y, z, color: lamp.color, strength: lamp.strength };
}

/**
 * Returns the vector from the specimen's middle to a lamp, in lengths of the longest edge, or the
 * direction of a distant lamp.
 */
function offsetOf({ towards, position_um }: StageLamp, { min, max }: Bounds): Vec3 {
  if (position_um === null) return towards ?? [0, 0, 1];
  const edge = Math.max(...max.map((v, k) => v - min[k]));
  const [x, y, z] = position_um.map((v, k) => (v - (min[k] + max[k]) / 2) / edge);
  return [x, y, z];
}
