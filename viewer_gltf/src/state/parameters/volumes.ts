/** The parameters of where volumes show. Pure. */

import { REFUSED } from "../refusals";
import { type ChoiceParameter, lensesOf, type NumberParameter, type Parameter } from "./kinds";

/**
 * Where volumes are drawn. `disc`: round the gaze, across tiles. `tile`: in the gazed tile. `all`:
 * in all tiles. `stage`: as the stage has it; there are none of these unless an artist chose it.
 * `traced`: in all tiles, by paths of light. `off`: nowhere. The first two hold within the switch distance.
 */
const MODES = ["disc", "tile", "all", "stage", "traced", "off"] as const;
export type Mode = (typeof MODES)[number];

/**
 * What a ray makes of its samples. `over`: each veils those behind it. `maximum`: the largest value of each
 * channel, within its window. `sum`: their light adds up, and nothing veils.
 */
const COMPOSITINGS = ["over", "maximum", "sum"] as const;
export type Compositing = (typeof COMPOSITINGS)[number];

/** The volumes' parameters of a bundle that has just opened. */
export const START_VOLUMES = {
  mode: "disc" as Mode,
  /** Metres of the room: nearer than a headset's specimen is at the start. */
  switchDistance_m: 1.25,
  /** Angle between the gaze and the disc's rim. */
  discRadius_deg: 16,
  compositing: "over" as Compositing,
  /** By how much volumes shade one another, 0..1. */
  depthShading: 0.5,
};

export type VolumeSettings = Readonly<typeof START_VOLUMES>;

/** With what else decides which modes there are. */
type Volumes = VolumeSettings &
  Readonly<{ canTrace: boolean; tiles: readonly Readonly<{ representation: string }>[] }>;

const NO_FLOATS =
  "This device can't do path tracing: its graphics can't draw into floating-point textures.";
/** One step of a distance, as a factor: near and far feel alike. */
const DISTANCE_FACTOR = 1.1;

const lens = lensesOf<Volumes>();

/** The modes that can be chosen: as staged only where an artist has staged something. */
function modesOf({ tiles, canTrace }: Volumes): readonly Mode[] {
  const isStaged = tiles.some(({ representation }) => representation !== "mesh");
  return MODES.filter((mode) => (mode === "stage" ? isStaged : mode !== "traced" || canTrace));
}

const MODE_NAMES: Readonly<Record<Mode, string>> = {
  disc: "Focus disc of volume",
  tile: "One tile as volume",
  all: "Volumes everywhere",
  stage: "As set in the stage",
  traced: "Volumes in natural light",
  off: "Surfaces only",
};

export const MODE: ChoiceParameter<Volumes, Mode> = {
  kind: "choice",
  id: "mode",
  label: "Show",
  about: "Where the specimen shows its surfaces, and where its volumes.",
  isListed: true,
  link: "mode",
  ...lens("mode"),
  values: MODES,
  names: MODE_NAMES,
  options: modesOf,
  fault: ({ canTrace }, mode) => (mode === "traced" && !canTrace ? NO_FLOATS : null),
  key: ["m", "Next mode: where volumes show"],
  spoken: ({ mode }) => MODE_NAMES[mode],
};

const metres = (value: number) => `${value.toPrecision(2)} m`;

export const SWITCH_DISTANCE: NumberParameter<Volumes> = {
  kind: "number",
  id: "switch-distance",
  label: "Volume distance",
  name: () => "Volume distance: volumes show within",
  about:
    "From nearer than this, the focus disc or the tile shows the volume. From farther away it shows surfaces.",
  link: "switch",
  ...lens("switchDistance_m"),
  limits: [0.1, 10],
  steps: 100,
  isLogarithmic: true,
  rounded: (value) => Number(value.toPrecision(3)),
  text: metres,
  refusal: ({ mode }) => (mode === "disc" || mode === "tile" ? "" : REFUSED.near),
  keys: {
    less: ["s", "Smaller volume distance"],
    more: ["S", "Larger volume distance"],
    next: (value, direction) => Number((value * DISTANCE_FACTOR ** direction).toPrecision(3)),
  },
  spoken: ({ switchDistance_m }) => `Volumes within ${metres(switchDistance_m)}`,
};

const degrees = (value: number) => `${Number(value.toFixed(1))}°`;

export const DISC_RADIUS: NumberParameter<Volumes> = {
  kind: "number",
  id: "disc-radius",
  label: "Focus disc",
  about:
    "Half of the angle that the round window in the middle of the view takes. Volumes show inside it. At most twelve tiles show as volumes in it.",
  link: "disc",
  ...lens("discRadius_deg"),
  limits: [2, 40],
  steps: 76,
  rounded: (value) => Number(value.toFixed(2)),
  text: degrees,
  refusal: ({ mode }) => (mode === "disc" ? "" : REFUSED.disc),
  keys: {
    less: ["d", "Smaller focus disc"],
    more: ["D", "Larger focus disc"],
    next: (value, direction) => value + direction,
  },
  spoken: ({ discRadius_deg }) => `Focus disc ${degrees(discRadius_deg)}`,
};

export const COMPOSITING: ChoiceParameter<Volumes, Compositing> = {
  kind: "choice",
  id: "compositing",
  label: "Along a ray",
  about: "How things that lie behind one another appear.",
  link: "ray",
  ...lens("compositing"),
  values: COMPOSITINGS,
  names: { over: "Opacity", maximum: "Maximum", sum: "Sum" },
  refusal: ({ mode }) => (mode === "traced" || mode === "off" ? REFUSED.marched : ""),
  key: ["%", "Next: opacity, maximum or sum along a ray"],
  spoken: ({ compositing }) => `Along a ray: ${compositing}`,
};

const percent = (value: number) => `${Math.round(100 * value)} %`;

const DEPTH_SHADING: NumberParameter<Volumes> = {
  kind: "number",
  id: "depth-shading",
  label: "Depth shading",
  about: "Enclosed places are darker, and things that lie before others throw shadows on them.",
  link: "depth",
  ...lens("depthShading"),
  limits: [0, 1],
  steps: 20,
  rounded: (value) => Number(value.toFixed(2)),
  text: percent,
  refusal: ({ mode, compositing }) => {
    if (mode === "traced" || mode === "off") return REFUSED.marched;
    if (mode !== "all") return REFUSED.shaded;
    return compositing === "over" ? "" : REFUSED.opacity;
  },
  keys: {
    less: ["PageDown", "Less depth shading"],
    more: ["PageUp", "More depth shading"],
    next: (value, direction) => Number((value + 0.1 * direction).toFixed(2)),
  },
  spoken: ({ depthShading }) => `Depth shading ${percent(depthShading)}`,
};

/**
 * Whether volumes throw shadows on one another. Surfaces get none: beside them a volume would look like
 * something else.
 */
export function canBeShaded({ mode, compositing }: Volumes): boolean {
  return mode === "all" && compositing === "over";
}

/** In the panel's order. */
export const VOLUMES: readonly Parameter<Volumes>[] = [
  MODE,
  SWITCH_DISTANCE,
  DISC_RADIUS,
  COMPOSITING,
  DEPTH_SHADING,
];

/** Whether volumes are drawn by paths of light. */
export function isTraced({ mode }: Pick<VolumeSettings, "mode">): boolean {
  return mode === "traced";
}
