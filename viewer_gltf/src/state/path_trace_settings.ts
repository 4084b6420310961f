/**
 * Settings of a path-traced image, as plain data and pure functions. A number needs only its row
 * below and its use: the panel, the keys and the links are made from the row.
 */
import type { Rgb } from "../math/color";

/**
 * A lamp: linear colour; x, y, z in lengths of the longest edge of the specimen's box, from its
 * middle, y up.
 */
export type Lamp = Readonly<{
  isOn: boolean;
  x: number;
  y: number;
  z: number;
  color: Rgb;
  /** At 1, the lamp gives the middle of the specimen as much light as a white environment. */
  strength: number;
}>;

export const ENVIRONMENTS = ["studio", "sky", "stage", "own"] as const;
export type EnvironmentName = (typeof ENVIRONMENTS)[number];

export const TONE_MAPS = ["filmic", "none"] as const;

/** Number of samples of each pixel with which a path-traced image counts as finished. */
export const ENOUGH_SAMPLES = 1024;

type TraceNumber = Readonly<{
  label: string;
  /** Value of the setting in a bundle that has just opened. */
  start: number;
  limits: readonly [number, number];
  /** Whether equal movements of the slider multiply the value by equal factors. */
  isLogarithmic?: boolean;
  text: (value: number) => string;
  /** Explanation of the effect, where the label does not say it. */
  about?: string;
}>;
type TraceNumbers = Readonly<Record<string, TraceNumber>>;

const plain = (value: number) => Number(value.toFixed(2)).toString();
const factor = (value: number) => `${plain(value)} x`;
const percent = (value: number) => `${Math.round(100 * value)} %`;
const degrees = (value: number) => `${Math.round(value)}°`;
const stops = (value: number) => `${value >= 0 ? "+" : ""}${value.toFixed(1)} stops`;

/** Number settings of the specimen as a medium that light passes through. */
export const MEDIUM_NUMBERS = {
  /** Number that is added to the intensities before the transfer function. */
  bias: {
    label: "Transmission",
    start: 0,
    limits: [-1, 1],
    text: plain,
    about:
      "Shifts the transfer function: a higher value also shows darker material, a lower value only the brightest.",
  },
  /**
   * Intensity, 0..1, below which a voxel counts as empty. With 0, only voxels without opacity in
   * the transfer function count as empty.
   */
  threshold: {
    label: "Threshold",
    start: 0,
    limits: [0, 1],
    text: (value) => (value === 0 ? "auto" : percent(value)),
    about: "Voxels darker than this are empty. On auto, the transfer function decides.",
  },
  /** Samples along the diagonal of the specimen; 0: as many as the time of a frame allows. */
  steps: {
    label: "Steps",
    start: 0,
    limits: [0, 500],
    text: (value) => (value === 0 ? "auto" : value.toFixed(0)),
    about:
      "Samples along a ray through the specimen: few are fast, many are exact. Auto takes as many as time allows.",
  },
  /** Factor to the extinction, which is how much light the medium blocks per length. */
  density: {
    label: "Density",
    start: 1,
    limits: [0.05, 20],
    isLogarithmic: true,
    text: factor,
    about: "How much light the material stops: low values look like mist, high values look solid.",
  },
  /** How readily a gradient scatters like a surface. */
  surface: {
    label: "Surfaces",
    start: 0.6,
    limits: [0, 1],
    text: percent,
    about:
      "How readily an edge in the material is lit as a surface; at 0 % everything looks like mist.",
  },
  shine: {
    label: "Shine",
    start: 0.5,
    limits: [0, 1],
    text: percent,
    about: "How polished surfaces look.",
  },
  /** Asymmetry g of Henyey and Greenstein's phase function, -1..1. */
  anisotropy: {
    label: "Forward scattering",
    start: 0,
    limits: [-0.95, 0.95],
    text: plain,
    about: "Direction of scattered light: above 0 mostly onwards, below 0 mostly back.",
  },
} as const satisfies TraceNumbers;

/** Brightness of the environment, and its rotation about the vertical axis. */
export const ENVIRONMENT_NUMBERS = {
  environmentLight: { label: "Environment light", start: 1, limits: [0, 4], text: factor },
  environmentTurn_deg: {
    label: "Environment rotation",
    start: 0,
    limits: [-180, 180],
    text: degrees,
  },
} as const satisfies TraceNumbers;

/** Numbers of the image adjustments, which follow path tracing. */
export const POST_NUMBERS = {
  /**
   * Stops. At the start value, the specimen is as bright as its surfaces, which are drawn without a
   * tone map.
   */
  exposure: {
    label: "Exposure",
    start: -0.5,
    limits: [-4, 4],
    text: stops,
    about: "Brightness of the image: one stop more is twice as bright.",
  },
  hue: { label: "Hue", start: 0, limits: [-180, 180], text: degrees },
  saturation: { label: "Saturation", start: 1, limits: [0, 3], text: percent },
  lightness: { label: "Luminance", start: 0, limits: [-0.5, 0.5], text: percent },
  occlusion: {
    label: "Ambient occlusion",
    start: 0.3,
    limits: [0, 1],
    text: percent,
    about: "How dark corners and hollows appear.",
  },
  sharpness: {
    label: "Sharpness",
    start: 0.2,
    limits: [0, 2],
    text: percent,
    about: "How strongly edges in the finished picture are sharpened. 0 % leaves them as they are.",
  },
} as const satisfies TraceNumbers;

/**
 * Largest distance of a lamp along each axis, in lengths of the specimen's longest edge. A hand
 * beside the specimen can still reach the lamp there.
 */
export const LAMP_REACH = 3;

/** Numbers of one lamp: its place and its strength. */
export const LAMP_NUMBERS = {
  x: { label: "Left to right", limits: [-LAMP_REACH, LAMP_REACH], steps: 120, text: plain },
  y: { label: "Bottom to top", limits: [-LAMP_REACH, LAMP_REACH], steps: 120, text: plain },
  z: { label: "Back to front", limits: [-LAMP_REACH, LAMP_REACH], steps: 120, text: plain },
  strength: { label: "Strength", limits: [0, 10], steps: 100, text: factor },
} as const;

type NumbersOf<T extends TraceNumbers> = { readonly [K in keyof T]: number };

export type TraceSettings = NumbersOf<typeof MEDIUM_NUMBERS> &
  NumbersOf<typeof ENVIRONMENT_NUMBERS> &
  NumbersOf<typeof POST_NUMBERS> &
  Readonly<{
    /** true: light is scattered until it leaves the specimen; false: it is scattered only once. */
    isMultiple: boolean;
    environment: EnvironmentName;
    lamps: readonly Lamp[];
    /** Whether the image adjustments, such as exposure, sharpness and occlusion, are applied. */
    isPostOn: boolean;
    toneMap: (typeof TONE_MAPS)[number];
  }>;

/** Key light from the upper left, fill light from the right, rim light from behind. */
const START_LAMPS: readonly Lamp[] = [
  { isOn: true, x: -0.9, y: 0.9, z: 1.1, color: [1, 0.96, 0.9], strength: 1.6 },
  { isOn: false, x: 1.2, y: 0.3, z: 0.8, color: [0.8, 0.88, 1], strength: 0.6 },
  { isOn: false, x: 0.3, y: 0.9, z: -1.2, color: [1, 1, 1], strength: 1 },
];
export const LAMPS = START_LAMPS.length;

function startsOf<T extends TraceNumbers>(numbers: T): NumbersOf<T> {
  const starts = Object.entries(numbers).map(([name, { start }]) => [name, start]);
  return Object.fromEntries(starts) as NumbersOf<T>;
}

export const START_TRACE: TraceSettings = {
  ...startsOf(MEDIUM_NUMBERS),
  isMultiple: true,
  ...startsOf(ENVIRONMENT_NUMBERS),
  environment: "studio",
  lamps: START_LAMPS,
  ...startsOf(POST_NUMBERS),
  isPostOn: true,
  toneMap: "filmic",
};

/** Returns the settings with one lamp changed. */
export function withLamp(
  trace: TraceSettings,
  index: number,
  change: Partial<Lamp>,
): TraceSettings {
  const lamps = trace.lamps.map((lamp, i) => (i === index ? { ...lamp, ...change } : lamp));
  return { ...trace, lamps };
}

const PATH_SETTINGS: readonly (keyof TraceSettings)[] = [
  ...(Object.keys(MEDIUM_NUMBERS) as (keyof typeof MEDIUM_NUMBERS)[]),
  ...(Object.keys(ENVIRONMENT_NUMBERS) as (keyof typeof ENVIRONMENT_NUMBERS)[]),
  "isMultiple",
  "environment",
  "lamps",
];

/** Returns whether two settings need different paths, and not only different image adjustments. */
export function needsNewPaths(a: TraceSettings, b: TraceSettings): boolean {
  return PATH_SETTINGS.some((name) => a[name] !== b[name]);
}
