/** The parameters of taps, gaze, stereo and quality. Pure. */
import { QUALITY_LEVELS, type QualityLevel } from "../quality_controller";
import { REFUSED } from "../refusals";
import {
  type ChoiceParameter,
  lensesOf,
  type NumberParameter,
  type Parameter,
  type SwitchParameter,
} from "./kinds";

const TOOLS = ["select", "measure"] as const;
/** `select` selects the tile that is tapped; `measure` adds the tapped point to a measurement. */
export type Tool = (typeof TOOLS)[number];

const MEASURES = ["distance", "angle", "line"] as const;
/** Between two points; the angle at the second of three points; along a line through several points. */
export type MeasureKind = (typeof MEASURES)[number];

const SCREEN_STEREO_KINDS = ["off", "anaglyph", "side-by-side"] as const;
/** Stereo on the screen of the page: for red-cyan glasses, or both eyes' images side by side. */
export type ScreenStereo = (typeof SCREEN_STEREO_KINDS)[number];

/** Settings of the tools in a bundle that has just opened. */
export const START_TOOLS = {
  /** Effect of a tap or a resting gaze on the specimen. */
  tool: "select" as Tool,
  /** Kind of the next measurement. */
  measureKind: "distance" as MeasureKind,
  /** Whether a gaze that rests for 1.5 s acts like a press of the button. */
  isDwellOn: true,
  quality: "auto" as QualityLevel,
  /** Distance between the user's pupils, mm; adults have 54 to 74. */
  eyeDistance_mm: 63,
  /** Factor to the eye distance; 0 shows both eyes the same image. */
  stereoStrength: 1,
  /** Length of the specimen's longest edge in stereo, m. */
  specimenSize_m: 1.2,
  screenStereo: "off" as ScreenStereo,
};

export type ToolSettings = Readonly<typeof START_TOOLS>;

const lens = lensesOf<ToolSettings>();

export const TOOL: ChoiceParameter<ToolSettings, Tool> = {
  kind: "choice",
  id: "tool",
  label: "Tap to",
  about: "The effect of a click, a tap or a resting gaze on the specimen.",
  link: "tool",
  ...lens("tool"),
  values: TOOLS,
  names: { select: "Select", measure: "Measure" },
  key: ["p", "A tap selects or measures"],
  spoken: ({ tool }) => `A tap ${tool}s`,
};

export const MEASURE_KIND: ChoiceParameter<ToolSettings, MeasureKind> = {
  kind: "choice",
  id: "measure-kind",
  label: "Measure",
  about: "The kind of the next measurement.",
  link: "measure",
  ...lens("measureKind"),
  values: MEASURES,
  names: { distance: "Distance", angle: "Angle", line: "Line" },
  refusal: ({ tool }) => (tool === "measure" ? "" : REFUSED.measuring),
  key: ["&", "Next: distance, angle, line through points"],
  spoken: ({ measureKind }) => `Measure: ${measureKind}`,
};

export const DWELL: SwitchParameter<ToolSettings> = {
  kind: "switch",
  id: "dwell",
  label: "Choose by gaze (1.5 s)",
  about: "In stereo, looking at something for 1.5 s is the same as pressing a button.",
  link: "dwell",
  ...lens("isDwellOn"),
  key: ["j", "Choosing by gaze on or off"],
  spoken: ({ isDwellOn }) => `Choosing by gaze: ${isDwellOn ? "on" : "off"}`,
};

export const QUALITY: ChoiceParameter<ToolSettings, QualityLevel> = {
  kind: "choice",
  id: "quality",
  label: "Quality",
  about: "How finely volumes are drawn while the view moves.",
  link: "quality",
  ...lens("quality"),
  values: QUALITY_LEVELS,
  names: { auto: "Auto", low: "Low", high: "High" },
  key: ["q", "Next quality"],
  spoken: ({ quality }) => `Quality: ${quality}`,
};

export const EYE_DISTANCE: NumberParameter<ToolSettings> = {
  kind: "number",
  id: "eye-distance",
  label: "Eye distance",
  about: "The distance between your pupils, for the split screen. A headset knows its own.",
  ...lens("eyeDistance_mm"),
  limits: [50, 76],
  steps: 52,
  rounded: (value) => Math.round(2 * value) / 2,
  text: (value) => `${value} mm`,
  spoken: ({ eyeDistance_mm }) => `Eye distance ${eyeDistance_mm} mm`,
};

export const STEREO_STRENGTH: NumberParameter<ToolSettings> = {
  kind: "number",
  id: "stereo-strength",
  label: "Stereo strength",
  about: "100 % shows the depth as your eyes would see it. At 0 % both eyes see the same image.",
  ...lens("stereoStrength"),
  limits: [0, 2],
  steps: 40,
  rounded: (value) => Number(value.toFixed(2)),
  text: (value) => `${Math.round(100 * value)} %`,
  spoken: ({ stereoStrength }) => `Stereo strength ${Math.round(100 * stereoStrength)} %`,
};

const size = (value: number) =>
  value < 1 ? `${Math.round(100 * value)} cm` : `${value.toFixed(1)} m`;

const SPECIMEN_SIZE: NumberParameter<ToolSettings> = {
  kind: "number",
  id: "specimen-size",
  label: "Size in stereo",
  about: "The length of the specimen's longest edge in stereo.",
  ...lens("specimenSize_m"),
  limits: [0.2, 6],
  steps: 60,
  isLogarithmic: true,
  rounded: (value) => Number(value.toPrecision(2)),
  text: size,
  spoken: ({ specimenSize_m }) => `The specimen's longest edge: ${size(specimenSize_m)}`,
};

export const SCREEN_STEREO: ChoiceParameter<ToolSettings, ScreenStereo> = {
  kind: "choice",
  id: "screen-stereo",
  label: "On this screen",
  about:
    "Shows depth without a headset; Esc ends it. The eye distance and the strength below apply here as well.",
  link: "stereo",
  ...lens("screenStereo"),
  values: SCREEN_STEREO_KINDS,
  names: { off: "Off", anaglyph: "Red-cyan glasses", "side-by-side": "Side by side" },
  isListed: true,
  key: ["F8", "Next stereo on this screen: red-cyan glasses, side by side, off"],
  spoken: ({ screenStereo }) => `Stereo on this screen: ${SCREEN_STEREO.names[screenStereo]}`,
};

/** Numbers of stereo. The keys for the numbers of the light change them, too. */
export const STEREO_NUMBERS: readonly NumberParameter<ToolSettings>[] = [
  EYE_DISTANCE,
  STEREO_STRENGTH,
  SPECIMEN_SIZE,
];

/** Rows by the section of the panel that lists them. */
export const STEREO_PARAMETERS: readonly Parameter<ToolSettings>[] = [DWELL, ...STEREO_NUMBERS];
export const MEASURE_PARAMETERS: readonly Parameter<ToolSettings>[] = [TOOL, MEASURE_KIND];
export const QUALITY_PARAMETERS: readonly Parameter<ToolSettings>[] = [QUALITY];
