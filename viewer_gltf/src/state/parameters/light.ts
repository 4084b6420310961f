/** The parameters of the path-traced picture: its medium, its light, and what comes after. Pure. */
import {
  ENVIRONMENTS,
  type EnvironmentName,
  LAMP_NUMBERS,
  LAMPS,
  type Lamp,
  MEDIUM_NUMBERS,
  POST_NUMBERS,
  ROOM_NUMBERS,
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

/** The light of a bundle that has just opened. */
export const START_LIGHT = {
  /** How the picture of the mode `traced` is made. */
  trace: START_TRACE,
  /** Whether the stage has a room, the light of its domes. */
  hasStageRoom: false,
  /** Whether its lamps can be seen, and taken hold of. */
  areLampsShown: false,
};

export type LightSettings = Readonly<typeof START_LIGHT>;

type Light = LightSettings & Pick<VolumeSettings, "mode">;

/** Why nothing of the light can be set: nothing is drawn by it. */
export const TRACED_ALONE = "Only path tracing has this setting: switch path tracing on first.";
const refusal = (on: Light) => (isTraced(on) ? "" : TRACED_ALONE);

const lens = lensesOf<Light>();
const traceLens = lensesOf<TraceSettings>();
const lampLens = lensesOf<Lamp>();

/** How a field of the picture's settings is read and written. */
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

/** The same of a lamp. */
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

/** Six digits are more than a step of the slider needs. */
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
  label: "Scattered many times",
  about: "Softer light, which goes on from where it is stopped; off: it stops there.",
  link: "many",
  refusal,
  ...ofTrace("isMultiple"),
  key: ["M", "Scattered once or many times"],
  spoken: ({ trace }) => `Scattered ${trace.isMultiple ? "many times" : "once"}`,
};

const environmentOf = ofTrace("environment");

export const ENVIRONMENT: ChoiceParameter<Light, EnvironmentName> = {
  kind: "choice",
  id: "trace-room",
  label: "Room",
  link: "room",
  refusal,
  get: environmentOf.get,
  set: (on, value) => (value === "stage" && !on.hasStageRoom ? on : environmentOf.set(on, value)),
  values: ENVIRONMENTS,
  names: { studio: "Studio", sky: "Sky", stage: "Stage", own: "Own" },
  options: ({ trace, hasStageRoom }) =>
    ENVIRONMENTS.filter(
      (name) =>
        (name !== "own" || trace.environment === "own") && (name !== "stage" || hasStageRoom),
    ),
  ownValue: "own",
  key: ["I", "Next room"],
  spoken: ({ trace }) => `Room: ${trace.environment}`,
};

export const LAMPS_SHOWN: SwitchParameter<Light> = {
  kind: "switch",
  id: "trace/lamps",
  label: "Show lamps",
  name: () => "Show the lamps, to be dragged",
  link: "lamps",
  refusal,
  ...lens("areLampsShown"),
  key: ["$", "Show or hide the lamps, to be dragged"],
  spoken: ({ areLampsShown, trace }) => {
    if (!areLampsShown) return "Lamps hidden";
    return trace.lamps.some(({ isOn }) => isOn) ? "Lamps shown: drag them" : "No lamp is on";
  },
};

const POST: SwitchParameter<Light> = {
  kind: "switch",
  id: "trace/post",
  label: "After (off: before)",
  name: () => "Show the picture after these changes",
  link: "after",
  refusal,
  ...ofTrace("isPostOn"),
  key: ["Z", "Before or after what comes after the light"],
  spoken: ({ trace }) => (trace.isPostOn ? "After" : "Before"),
};

const TONE_MAP: ChoiceParameter<Light, TraceSettings["toneMap"]> = {
  kind: "choice",
  id: "trace-tone-map",
  label: "Tone map",
  about: "Film keeps what is bright from turning white.",
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
  /** Where it is: x, y, z. */
  place: readonly NumberParameter<Light>[];
  /** All of its numbers. */
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
      spoken: () => `${title}: another colour`,
    },
    place: numbers.slice(0, 3),
    numbers,
  };
}

/** In the panel's order: what light goes through and where it is, the room, the lamps, what comes after. */
export const MEDIUM: readonly Parameter<Light>[] = [
  ...numbersOf(MEDIUM_NUMBERS),
  MULTIPLE,
  ENVIRONMENT,
];
export const ROOM: readonly Parameter<Light>[] = numbersOf(ROOM_NUMBERS);
export const LAMP: readonly LampParameters[] = Array.from({ length: LAMPS }, (_, i) => lampOf(i));
export const AFTER: readonly Parameter<Light>[] = [POST, ...numbersOf(POST_NUMBERS), TONE_MAP];

const rows: readonly Parameter<Light>[] = [
  ...MEDIUM,
  ...ROOM,
  ...LAMP.flatMap(({ numbers, isOn, color }) => [...numbers, isOn, color]),
  ...AFTER,
];

/** Every number, which two keys turn one at a time. */
export const LIGHT_NUMBERS = rows.filter((row) => row.kind === "number");
/** All of the light, in a link's order: numbers first. */
export const LIGHT: readonly Parameter<Light>[] = [
  ...LIGHT_NUMBERS,
  ...rows.filter((row) => row.kind !== "number"),
];
