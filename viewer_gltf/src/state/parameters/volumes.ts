/** The parameters that decide where volumes are drawn, and how. Pure. */

import { REFUSED } from "../refusals";
import { type ChoiceParameter, lensesOf, type NumberParameter, type Parameter } from "./kinds";

/**
 * Where volumes are drawn. Mode `disc` draws them around the gaze, across tiles, and `tile` in the
 * gazed tile; both only within the volume distance. Mode `all` draws them in all tiles, and `traced`
 * does so by path tracing. Mode `stage` follows the stage, if that draws any tile as a volume. Mode
 * `off` draws no volumes.
 */
const MODES = ["disc", "tile", "all", "stage", "traced", "off"] as const;
export type Mode = (typeof MODES)[number];

/**
 * How the samples along a ray are combined. With `over`, each sample partly hides those behind it.
 * With `maximum`, only the largest value of each channel counts, within its window. With `sum`, the
 * light of all samples is added, and nothing is hidden.
 */
const COMPOSITINGS = ["over", "maximum", "sum"] as const;
export type Compositing = (typeof COMPOSITINGS)[number];

/** Settings of volumes in a bundle that has just opened. */
export const START_VOLUMES = {
  mode: "disc" as Mode,
  /** Metres of the scene. The opening distance of a headset's specimen is larger. */
  switchDistance_m: 1.25,
  /** Angle between the gaze and the rim of the disc, degrees. */
  discRadius_deg: 16,
  compositing: "over" as Compositing,
  /** How strongly volumes cast shadows on one another, 0..1. */
  depthShading: 0.5,
};

export type VolumeSettings = Readonly<typeof START_VOLUMES>;

/** The settings of volumes, with the values that decide which modes are available. */
type Volumes = VolumeSettings &
  Readonly<{ canTrace: boolean; tiles: readonly Readonly<{ representation: string }>[] }>;

const NO_FLOATS =
  "This device can't do path tracing: its graphics can't draw into floating-point textures.";
/** Factor of one step of the distance, so that steps feel equal near and far. */
const DISTANCE_FACTOR = 1.1;

const lens = lensesOf<Volumes>();

/** Returns the available modes. `stage` is one of them only if the stage draws a tile as a volume. */
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
  about: "Where the specimen is drawn as surfaces, and where as volumes.",
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
    "Closer than this, the focus disc or the tile shows the volume; farther away it shows surfaces.",
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
    "Radius of the round window in the middle of the view in which volumes are shown, as an angle. It shows the volumes of at most twelve tiles.",
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
  label: "Projection",
  about: "How structures that lie behind one another are combined.",
  link: "ray",
  ...lens("compositing"),
  values: COMPOSITINGS,
  names: { over: "Opacity", maximum: "Maximum", sum: "Sum" },
  refusal: ({ mode }) => (mode === "traced" || mode === "off" ? REFUSED.marched : ""),
  key: ["%", "Next projection: opacity, maximum, sum"],
  spoken: ({ compositing }) => `Projection: ${compositing}`,
};

const percent = (value: number) => `${Math.round(100 * value)} %`;

const DEPTH_SHADING: NumberParameter<Volumes> = {
  kind: "number",
  id: "depth-shading",
  label: "Depth shading",
  about: "Darkens enclosed places, and lets structures in front cast shadows on those behind.",
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
 * Returns whether volumes cast shadows on one another. Surfaces get no shadows, so a shaded volume
 * beside them would look like another material.
 */
export function canBeShaded({ mode, compositing }: Volumes): boolean {
  return mode === "all" && compositing === "over";
}

/** Rows in the order of the panel. */
export const VOLUMES: readonly Parameter<Volumes>[] = [
  MODE,
  SWITCH_DISTANCE,
  DISC_RADIUS,
  COMPOSITING,
  DEPTH_SHADING,
];

/** Returns whether volumes are drawn by path tracing. */
export function isTraced({ mode }: Pick<VolumeSettings, "mode">): boolean {
  return mode === "traced";
}
