/**
 * What a path-traced picture is made with. Plain data, and pure functions on it. A row of the numbers
 * below is all that a new one takes besides its use: panel, keys and links go by it.
 */
import type { Rgb } from "../math/color";

/** Linear colour; x, y, z in longest edges of the specimen's box, from its middle, y up. */
export type Lamp = Readonly<{
  isOn: boolean;
  x: number;
  y: number;
  z: number;
  color: Rgb;
  /** 1: as much light on the specimen's middle as a white room gives. */
  strength: number;
}>;

export const ENVIRONMENTS = ["studio", "sky", "stage", "own"] as const;
export type EnvironmentName = (typeof ENVIRONMENTS)[number];

export const TONE_MAPS = ["filmic", "none"] as const;

/** Samples of each pixel in a finished picture. */
export const ENOUGH_SAMPLES = 1024;

type TraceNumber = Readonly<{
  label: string;
  /** The value in a bundle that has just opened. */
  start: number;
  limits: readonly [number, number];
  /** Equal steps are equal factors. */
  isLogarithmic?: boolean;
  text: (value: number) => string;
  /** What it does, where its name can't say it. */
  about?: string;
}>;
type TraceNumbers = Readonly<Record<string, TraceNumber>>;

const plain = (value: number) => Number(value.toFixed(2)).toString();
const factor = (value: number) => `${plain(value)} x`;
const percent = (value: number) => `${Math.round(100 * value)} %`;
const degrees = (value: number) => `${Math.round(value)}°`;
const stops = (value: number) => `${value >= 0 ? "+" : ""}${value.toFixed(1)} stops`;

/** Numbers of the medium that light goes through. */
export const MEDIUM_NUMBERS = {
  /** Added to the intensities before the transfer function. */
  bias: {
    label: "Transmission",
    start: 0,
    limits: [-1, 1],
    text: plain,
    about:
      "Shifts the transfer function: more shows darker material, too; less only the brightest.",
  },
  /** Share of the intensities; 0: the transfer function alone decides what is empty. */
  threshold: {
    label: "Threshold",
    start: 0,
    limits: [0, 1],
    text: (value) => (value === 0 ? "auto" : percent(value)),
    about: "Voxels below it are empty. Auto: as the transfer function has it.",
  },
  /** Along the specimen's diagonal; 0: as many as the frame's budget allows. */
  steps: {
    label: "Steps",
    start: 0,
    limits: [0, 500],
    text: (value) => (value === 0 ? "auto" : value.toFixed(0)),
    about: "Along a ray through the specimen: few are fast, many are exact. Auto: as time allows.",
  },
  /** Factor to the extinction. */
  density: {
    label: "Density",
    start: 1,
    limits: [0.05, 20],
    isLogarithmic: true,
    text: factor,
    about: "How much light it stops: less is mist, more is solid.",
  },
  /** How readily a gradient makes a surface. */
  surface: {
    label: "Surfaces",
    start: 0.6,
    limits: [0, 1],
    text: percent,
    about: "How readily an edge in it is lit as a surface; at 0 % all is mist.",
  },
  /** A surface's shine. */
  shine: {
    label: "Shine",
    start: 0.5,
    limits: [0, 1],
    text: percent,
    about: "From dull surfaces to polished ones.",
  },
  /** Henyey-Greenstein g. */
  anisotropy: {
    label: "Scatters forward",
    start: 0,
    limits: [-0.95, 0.95],
    text: plain,
    about: "Where light goes from where it is stopped: above 0 mostly on, below 0 mostly back.",
  },
} as const satisfies TraceNumbers;

/** Factor to the environment's light, and by how much it is turned. */
export const ROOM_NUMBERS = {
  environmentLight: { label: "Light of the room", start: 1, limits: [0, 4], text: factor },
  environmentTurn_deg: { label: "Room turned", start: 0, limits: [-180, 180], text: degrees },
} as const satisfies TraceNumbers;

/** Numbers of the post-processing. */
export const POST_NUMBERS = {
  /** At the start a specimen is as bright as its surfaces are, whose light has no tone map. */
  exposure: {
    label: "Exposure",
    start: -0.5,
    limits: [-4, 4],
    text: stops,
    about: "One stop more is twice as bright.",
  },
  hue: { label: "Hue", start: 0, limits: [-180, 180], text: degrees },
  /** Factor. */
  saturation: { label: "Saturation", start: 1, limits: [0, 3], text: percent },
  /** Added. */
  lightness: { label: "Luminance", start: 0, limits: [-0.5, 0.5], text: percent },
  occlusion: {
    label: "Ambient occlusion",
    start: 0.3,
    limits: [0, 1],
    text: percent,
    about: "How dark corners and hollows are.",
  },
  sharpness: { label: "Sharpness", start: 0.2, limits: [0, 2], text: percent },
} as const satisfies TraceNumbers;

/** Farthest place of a lamp, in lengths of the specimen: a hand round it reaches the lamp. */
export const LAMP_REACH = 3;

/** Numbers of one lamp: its place, and its strength. */
export const LAMP_NUMBERS = {
  x: { label: "Left to right", limits: [-LAMP_REACH, LAMP_REACH], steps: 120, text: plain },
  y: { label: "Down to up", limits: [-LAMP_REACH, LAMP_REACH], steps: 120, text: plain },
  z: { label: "Back to front", limits: [-LAMP_REACH, LAMP_REACH], steps: 120, text: plain },
  strength: { label: "Strength", limits: [0, 10], steps: 100, text: factor },
} as const;

type NumbersOf<T extends TraceNumbers> = { readonly [K in keyof T]: number };

export type TraceSettings = NumbersOf<typeof MEDIUM_NUMBERS> &
  NumbersOf<typeof ROOM_NUMBERS> &
  NumbersOf<typeof POST_NUMBERS> &
  Readonly<{
    /** Paths are scattered once, or until they leave. */
    isMultiple: boolean;
    environment: EnvironmentName;
    lamps: readonly Lamp[];
    /** The post-processing; off: the picture as it was gathered. */
    isPostOn: boolean;
    toneMap: (typeof TONE_MAPS)[number];
  }>;

/** From the left above, from the right, from behind: the key, the fill, the rim. */
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
  ...startsOf(ROOM_NUMBERS),
  environment: "studio",
  lamps: START_LAMPS,
  ...startsOf(POST_NUMBERS),
  isPostOn: true,
  toneMap: "filmic",
};

/** One lamp changed. */
export function withLamp(
  trace: TraceSettings,
  index: number,
  change: Partial<Lamp>,
): TraceSettings {
  const lamps = trace.lamps.map((lamp, i) => (i === index ? { ...lamp, ...change } : lamp));
  return { ...trace, lamps };
}

const GATHERED: readonly (keyof TraceSettings)[] = [
  ...(Object.keys(MEDIUM_NUMBERS) as (keyof typeof MEDIUM_NUMBERS)[]),
  ...(Object.keys(ROOM_NUMBERS) as (keyof typeof ROOM_NUMBERS)[]),
  "isMultiple",
  "environment",
  "lamps",
];

/** Whether what paths gather differs between two settings, and not only what is made of it. */
export function gathersAnew(a: TraceSettings, b: TraceSettings): boolean {
  return GATHERED.some((name) => a[name] !== b[name]);
}
