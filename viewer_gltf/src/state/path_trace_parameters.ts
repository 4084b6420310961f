/**
 * Every number of the path-traced picture that can be set: its name, its limits, where it stands and
 * what sets it. Panel, keys and links go by this list. Pure.
 */

import type { Action } from "./actions";
import {
  LAMP_REACH,
  LAMPS,
  MOST_STRENGTH,
  TRACE_LIMITS,
  type TraceSettings,
} from "./path_trace_settings";

export type Dial = Readonly<{
  id: string;
  name: string;
  limits: readonly [number, number];
  /** Steps from one end to the other: of a slider, and of a key. */
  steps: number;
  /** Equal steps are equal factors. */
  isLogarithmic?: boolean;
  of: (trace: TraceSettings) => number;
  to: (value: number) => Action;
  text: (value: number) => string;
}>;

const plain = (value: number) => Number(value.toFixed(2)).toString();
const percent = (value: number) => `${Math.round(100 * value)} %`;
const degrees = (value: number) => `${Math.round(value)}°`;
const stops = (value: number) => `${value >= 0 ? "+" : ""}${value.toFixed(1)} stops`;

type Numbers = keyof typeof TRACE_LIMITS;

function dial(id: Numbers, name: string, text: Dial["text"], isLogarithmic = false): Dial {
  return {
    id,
    name,
    limits: TRACE_LIMITS[id],
    steps: 100,
    isLogarithmic,
    of: (trace) => trace[id],
    to: (value) => ({ type: "trace", change: { [id]: value } }),
    text,
  };
}

export const MEDIUM_DIALS: readonly Dial[] = [
  dial("bias", "Bias", plain),
  dial("density", "Density", (value) => `${plain(value)} x`, true),
  dial("surface", "Surfaces", percent),
  dial("shine", "Shine", percent),
  dial("anisotropy", "Scatters forward", plain),
];

export const ROOM_DIALS: readonly Dial[] = [
  dial("environmentLight", "Light of the room", (value) => `${plain(value)} x`),
  dial("environmentTurn_deg", "Room turned", degrees),
];

export const POST_DIALS: readonly Dial[] = [
  dial("exposure", "Exposure", stops),
  dial("hue", "Hue", degrees),
  dial("saturation", "Saturation", percent),
  dial("lightness", "Lightness", percent),
  dial("occlusion", "Ambient occlusion", percent),
  dial("sharpness", "Sharpness", percent),
];

const AXES = ["x", "y", "z"] as const;

/** Of one lamp: where it is, and how strong. */
export function lampDials(lamp: number): readonly Dial[] {
  const place = (axis: 0 | 1 | 2, name: string): Dial => ({
    id: `lamp-${lamp}/${AXES[axis]}`,
    name,
    limits: [-LAMP_REACH, LAMP_REACH],
    steps: 120,
    of: (trace) => trace.lamps[lamp][AXES[axis]],
    to: (value) => ({ type: "move-lamp", lamp, change: { [AXES[axis]]: value } }),
    text: plain,
  });
  return [
    place(0, "Left to right"),
    place(1, "Down to up"),
    place(2, "Back to front"),
    {
      id: `lamp-${lamp}/strength`,
      name: "Strength",
      limits: [0, MOST_STRENGTH],
      steps: 100,
      of: (trace) => trace.lamps[lamp].strength,
      to: (value) => ({ type: "move-lamp", lamp, change: { strength: value } }),
      text: (value) => `${plain(value)} x`,
    },
  ];
}

/** All, in the panel's order. */
export const DIALS: readonly Dial[] = [
  ...MEDIUM_DIALS,
  ...ROOM_DIALS,
  ...Array.from({ length: LAMPS }, (_, lamp) => lampDials(lamp)).flat(),
  ...POST_DIALS,
];

/** With the lamp that it is of. */
export function dialName({ id, name }: Dial): string {
  const [, lamp] = /^lamp-(\d)/.exec(id) ?? [];
  return lamp === undefined ? name : `Lamp ${Number(lamp) + 1}, ${name.toLowerCase()}`;
}

/** Where a value is between a dial's ends, 0..1. */
export function shareOf({ limits: [low, high], isLogarithmic }: Dial, value: number): number {
  if (isLogarithmic) return Math.log(value / low) / Math.log(high / low);
  return (value - low) / (high - low);
}

export function valueAtShare({ limits: [low, high], isLogarithmic }: Dial, share: number): number {
  const value = isLogarithmic ? low * (high / low) ** share : low + (high - low) * share;
  return Number(value.toPrecision(6));
}
