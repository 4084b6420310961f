/** The parameters of the path-traced image: its medium, its light and the image adjustments. Pure. */
import {
  ENVIRONMENT_NUMBERS,
  ENVIRONMENTS,
  type EnvironmentName,
  LAMP_NUMBERS,
  LAMPS,
  type Lamp,
  MEDIUM_NUMBERS,
  POST_NUMBERS,
  START_TRACE,
  TONE_MAPS,
  type TraceSettings,
  withLamp,
} from "../path_trace_settings";
import {
  type ChoiceParameter,
  type ColourParameter,
  lensesOf,
  type NumberParameter,
  type Parameter,
  type SwitchParameter,
} from "./kinds";
import { isTraced, type VolumeSettings } from "./volumes";

/** Settings of the light in a bundle that has just opened. */
export const START_LIGHT = {
  /** Settings of path tracing, the mode `traced`. */
  trace: START_TRACE,
  /** Whether the stage has an environment, which is made of its dome lights. */
  hasStageEnvironment: false,
  /** Whether the lamps are shown, so that they can be dragged. */
  areLampsShown: false,
};

export type LightSettings = Readonly<typeof START_LIGHT>;

type Light = LightSettings & Pick<VolumeSettings, "mode">;

/** Reason why the settings of the light have no effect: nothing is drawn with them. */
export const TRACED_ALONE = "Only path tracing has this setting: switch path tracing on first.";
const refusal = (on: Light) => (isTraced(on) ? "" : TRACED_ALONE);

const lens = lensesOf<Light>();
const traceLens = lensesOf<TraceSettings>();
const lampLens = lensesOf<Lamp>();

/** Returns functions that read and write a field of the settings of path tracing. */
function ofTrace<K extends keyof TraceSettings>(name: K) {
  const inner = traceLens(name);
  return {
    get: ({ trace }: Light) => inner.get(trace),
    set: <S extends Light>(on: S, value: TraceSettings[K]): S => ({
      ...on,
      trace: inner.set(on.trace, value),
    }),
  };
}

/** Returns functions that read and write a field of a lamp. */
function ofLamp<K extends keyof Lamp>(lamp: number, name: K) {
  const inner = lampLens(name);
  return {
    get: ({ trace }: Light) => inner.get(trace.lamps[lamp]),
    set: <S extends Light>(on: S, value: Lamp[K]): S => ({
      ...on,
      trace: withLamp(on.trace, lamp, { [name]: value }),
    }),
  };
}

/** Rounds to six digits, which are more than a step of the slider needs. */
const rounded = (value: number) => Number(value.toPrecision(6));

function numbersOf<K extends string & keyof TraceSettings>(
  numbers: Readonly<
    Record<
      K,
      Readonly<{
        label: string;
        limits: readonly [number, number];
        isLogarithmic?: boolean;
        text: (value: number) => string;
      }>
    >
  >,
): readonly NumberParameter<Light>[] {
  return (Object.keys(numbers) as K[]).map((name) => {
    const { label, text } = numbers[name];
    const { get, set } = ofTrace(name as keyof typeof MEDIUM_NUMBERS);
    return {
      kind: "number",
      id: `trace/${name}`,
      link: name,
      refusal,
      steps: 100,
      rounded,
      ...numbers[name],
      get,
      set,
      spoken: (on) => `${label}: ${text(get(on))}`,
    };
  });
}

const MULTIPLE: SwitchParameter<Light> = {
  kind: "switch",
  id: "trace/multiple",
  label: "Multiple scattering",
  about:
    "Light is scattered until it leaves the specimen, which looks softer. Off: it is scattered once.",
  link: "many",
  refusal,
  ...ofTrace("isMultiple"),
  key: ["M", "Multiple scattering on or off"],
  spoken: ({ trace }) => `Multiple scattering: ${trace.isMultiple ? "on" : "off"}`,
};

const environmentOf = ofTrace("environment");

export const ENVIRONMENT: ChoiceParameter<Light, EnvironmentName> = {
  kind: "choice",
  id: "trace-room",
  label: "Environment",
  link: "room",
  refusal,
  get: environmentOf.get,
  set: (on, value) =>
    value === "stage" && !on.hasStageEnvironment ? on : environmentOf.set(on, value),
  values: ENVIRONMENTS,
  names: { studio: "Studio", sky: "Sky", stage: "Stage", own: "Own" },
  options: ({ trace, hasStageEnvironment }) =>
    ENVIRONMENTS.filter(
      (name) =>
        (name !== "own" || trace.environment === "own") &&
        (name !== "stage" || hasStageEnvironment),
    ),
  ownValue: "own",
  key: ["I", "Next environment"],
  spoken: ({ trace }) => `Environment: ${trace.environment}`,
};

export const LAMPS_SHOWN: SwitchParameter<Light> = {
  kind: "switch",
  id: "trace/lamps",
  label: "Show lamps",
  name: () => "Show lamps, which can be dragged",
  link: "lamps",
  refusal,
  ...lens("areLampsShown"),
  key: ["$", "Show or hide the lamps, which can be dragged"],
  spoken: ({ areLampsShown, trace }) => {
    if (!areLampsShown) return "Lamps hidden";
    return trace.lamps.some(({ isOn }) => isOn) ? "Lamps shown: drag them" : "No lamp is on";
  },
};

const POST: SwitchParameter<Light> = {
  kind: "switch",
  id: "trace/post",
  label: "Image adjustments",
  name: () => "Apply the image adjustments",
  link: "after",
  refusal,
  ...ofTrace("isPostOn"),
  key: ["Z", "Image adjustments on or off"],
  spoken: ({ trace }) => `Image adjustments: ${trace.isPostOn ? "on" : "off"}`,
};

const TONE_MAP: ChoiceParameter<Light, TraceSettings["toneMap"]> = {
  kind: "choice",
  id: "trace-tone-map",
  label: "Tone map",
  about: "Film keeps detail in bright areas, which would turn white otherwise.",
  link: "tone",
  refusal,
  ...ofTrace("toneMap"),
  values: TONE_MAPS,
  names: { filmic: "Film", none: "None" },
  spoken: ({ trace }) => `Tone map: ${trace.toneMap}`,
};

export type LampParameters = Readonly<{
  id: string;
  name: string;
  isOn: SwitchParameter<Light>;
  color: ColourParameter<Light>;
  /** Place of the lamp: x, y, z. */
  place: readonly NumberParameter<Light>[];
  /** All numbers of the lamp: its place and its strength. */
  numbers: readonly NumberParameter<Light>[];
}>;

function lampOf(lamp: number): LampParameters {
  const id = `lamp-${lamp}`;
  const title = `Lamp ${lamp + 1}`;
  const numbers = (["x", "y", "z", "strength"] as const).map((name): NumberParameter<Light> => {
    const { label, text } = LAMP_NUMBERS[name];
    const { get, set } = ofLamp(lamp, name);
    return {
      kind: "number",
      id: `trace/${id}/${name}`,
      link: `${id}/${name}`,
      refusal,
      rounded,
      ...LAMP_NUMBERS[name],
      get,
      set,
      spoken: (on) => `${title}, ${label.toLowerCase()}: ${text(get(on))}`,
    };
  });
  return {
    id,
    name: title,
    isOn: {
      kind: "switch",
      id: `${id}/on`,
      label: "On",
      name: () => `${title} on`,
      link: id,
      refusal,
      ...ofLamp(lamp, "isOn"),
      spoken: ({ trace }) => `${title}: ${trace.lamps[lamp].isOn ? "on" : "off"}`,
    },
    color: {
      kind: "colour",
      id: `${id}/color`,
      label: "Colour",
      name: () => `Colour of ${title}`,
      link: `${id}/color`,
      refusal,
      ...ofLamp(lamp, "color"),
      spoken: () => `${title}: new colour`,
    },
    place: numbers.slice(0, 3),
    numbers,
  };
}

/** Rows in the order of the panel: the medium, the environment, the lamps, the image adjustments. */
export const MEDIUM: readonly Parameter<Light>[] = [
  ...numbersOf(MEDIUM_NUMBERS),
  MULTIPLE,
  ENVIRONMENT,
];
export const ENVIRONMENT_ROWS: readonly Parameter<Light>[] = numbersOf(ENVIRONMENT_NUMBERS);
export const LAMP: readonly LampParameters[] = Array.from({ length: LAMPS }, (_, i) => lampOf(i));
export const AFTER: readonly Parameter<Light>[] = [POST, ...numbersOf(POST_NUMBERS), TONE_MAP];

const rows: readonly Parameter<Light>[] = [
  ...MEDIUM,
  ...ENVIRONMENT_ROWS,
  ...LAMP.flatMap(({ numbers, isOn, color }) => [...numbers, isOn, color]),
  ...AFTER,
];

/** All numbers. Two keys change the chosen number. */
export const LIGHT_NUMBERS = rows.filter((row) => row.kind === "number");
/** All parameters of the light in the order of a link: numbers first. */
export const LIGHT: readonly Parameter<Light>[] = [
  ...LIGHT_NUMBERS,
  ...rows.filter((row) => row.kind !== "number"),
];
