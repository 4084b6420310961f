/** What a path-traced picture is made with. Plain data, and pure functions on it. */

export type Vec3 = readonly [number, number, number];

/** Linear colour; x, y, z in longest edges of the specimen's box, from its middle, y up. */
export type Lamp = Readonly<{
  isOn: boolean;
  x: number;
  y: number;
  z: number;
  color: Vec3;
  /** 1: as much light on the specimen's middle as a white room gives. */
  strength: number;
}>;

export const ENVIRONMENTS = ["studio", "sky", "own"] as const;
export type EnvironmentName = (typeof ENVIRONMENTS)[number];

export const TONE_MAPS = ["filmic", "none"] as const;

export type TraceSettings = Readonly<{
  /** Added to the intensities before the transfer function, -1..1. */
  bias: number;
  /** Factor to the extinction. */
  density: number;
  /** Paths are scattered once, or until they leave. */
  isMultiple: boolean;
  /** Henyey-Greenstein g. */
  anisotropy: number;
  /** 0..1: how readily a gradient makes a surface. */
  surface: number;
  /** 0..1: a surface's shine. */
  shine: number;
  environment: EnvironmentName;
  /** Factor to the environment's light, and by how many degrees it is turned. */
  environmentLight: number;
  environmentTurn_deg: number;
  lamps: readonly Lamp[];
  /** What comes after the light; off: as it was gathered. */
  isPostOn: boolean;
  /** Stops. */
  exposure: number;
  toneMap: (typeof TONE_MAPS)[number];
  /** Degrees. */
  hue: number;
  /** Factor. */
  saturation: number;
  /** Added, -1..1. */
  lightness: number;
  /** 0..1 */
  occlusion: number;
  /** 0..2 */
  sharpness: number;
}>;

/** A picture with so many samples of each pixel is done. */
export const ENOUGH_SAMPLES = 1024;

export const LAMPS = 3;

/** From the left above, from the right, from behind: the key, the fill, the rim. */
const START_LAMPS: readonly Lamp[] = [
  { isOn: true, x: -0.9, y: 0.9, z: 1.1, color: [1, 0.96, 0.9], strength: 1.6 },
  { isOn: false, x: 1.2, y: 0.3, z: 0.8, color: [0.8, 0.88, 1], strength: 0.6 },
  { isOn: false, x: 0.3, y: 0.9, z: -1.2, color: [1, 1, 1], strength: 1 },
];

export const START_TRACE: TraceSettings = {
  bias: 0,
  density: 1,
  isMultiple: true,
  anisotropy: 0,
  surface: 0.6,
  shine: 0.5,
  environment: "studio",
  environmentLight: 1,
  environmentTurn_deg: 0,
  lamps: START_LAMPS,
  isPostOn: true,
  exposure: 0,
  toneMap: "filmic",
  hue: 0,
  saturation: 1,
  lightness: 0,
  occlusion: 0.3,
  sharpness: 0.2,
};

/** The limits of what a user can set. */
export const TRACE_LIMITS = {
  bias: [-1, 1],
  density: [0.05, 20],
  anisotropy: [-0.95, 0.95],
  surface: [0, 1],
  shine: [0, 1],
  environmentLight: [0, 4],
  environmentTurn_deg: [-180, 180],
  exposure: [-4, 4],
  hue: [-180, 180],
  saturation: [0, 3],
  lightness: [-0.5, 0.5],
  occlusion: [0, 1],
  sharpness: [0, 2],
} as const;

export type TraceNumber = keyof typeof TRACE_LIMITS;

/** Lamps stay within reach of a hand round the specimen. */
export const LAMP_REACH = 3;
const REACHES = [-LAMP_REACH, LAMP_REACH] as const;
export const MOST_STRENGTH = 10;

const clamp = (value: number, [low, high]: readonly [number, number]) =>
  Math.min(high, Math.max(low, value));

/** The settings with what is given put in, within its limits. */
export function withTrace(trace: TraceSettings, change: Partial<TraceSettings>): TraceSettings {
  const next = { ...trace, ...change };
  for (const name of Object.keys(TRACE_LIMITS) as TraceNumber[]) {
    const value = next[name];
    next[name] = Number.isFinite(value) ? clamp(value, TRACE_LIMITS[name]) : trace[name];
  }
  return next;
}

/** One lamp changed, within its limits. */
export function withLamp(
  trace: TraceSettings,
  index: number,
  change: Partial<Lamp>,
): TraceSettings {
  const lamps = trace.lamps.map((lamp, i) => {
    if (i !== index) return lamp;
    const next = { ...lamp, ...change };
    const within = (name: "x" | "y" | "z" | "strength", limits: readonly [number, number]) =>
      Number.isFinite(next[name]) ? clamp(next[name], limits) : lamp[name];
    const [x, y, z] = (["x", "y", "z"] as const).map((axis) => within(axis, REACHES));
    return { ...next, x, y, z, strength: within("strength", [0, MOST_STRENGTH]) };
  });
  return { ...trace, lamps };
}

/** Whether what paths gather differs between two settings, and not only what is made of it. */
export function gathersAnew(a: TraceSettings, b: TraceSettings): boolean {
  const GATHERED = [
    "bias",
    "density",
    "isMultiple",
    "anisotropy",
    "surface",
    "shine",
    "environment",
    "environmentLight",
    "environmentTurn_deg",
    "lamps",
  ] as const;
  return GATHERED.some((name) => a[name] !== b[name]);
}
