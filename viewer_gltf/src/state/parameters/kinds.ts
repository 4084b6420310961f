/**
 * A parameter: a number, a switch, a choice or a colour that a user sets, as one row of a table.
 * The panels, the keys, the links, the page's address and the spoken feedback are made from its
 * row. Pure.
 */
import type { Rgb } from "../../math/color";

export type Value = number | boolean | string | Rgb;

/** A key and its text in the list of keys. */
type KeyWords = readonly [key: string, label: string];

/** `On`: the part of the state that the parameter belongs to. */
type Row<On, T extends Value> = Readonly<{
  /** Id of the panel's control, and of the action that sets the parameter. */
  id: string;
  label: string;
  /** Label for places where nothing nearby names the subject. */
  name?: (on: On) => string;
  /** Name in a link; absent: no link has the parameter. */
  link?: string;
  /** Reason why the panel cannot set the parameter now; "": it can. */
  refusal?: (on: On) => string;
  /** Explanation in one sentence, where the label does not say it. */
  about?: string;
  get: (on: On) => T;
  /** The announcement after a key has set the parameter. */
  spoken: (on: On) => string;
}> & {
  /** @param value a value that `accepted` returns */
  set<S extends On>(on: S, value: T): S;
};

export type NumberParameter<On> = Row<On, number> &
  Readonly<{
    kind: "number";
    limits: readonly [number, number];
    /** Number of steps from one end of the slider to the other. */
    steps: number;
    /** Whether equal movements of the slider multiply the value by equal factors. */
    isLogarithmic?: boolean;
    /** Rounds a slider's value to the digits that a step needs. More digits would lengthen a link. */
    rounded: (value: number) => number;
    text: (value: number) => string;
    keys?: Readonly<{
      less: KeyWords;
      more: KeyWords;
      next: (value: number, direction: -1 | 1) => number;
    }>;
  }>;

export type SwitchParameter<On> = Row<On, boolean> & Readonly<{ kind: "switch"; key?: KeyWords }>;

export type ChoiceParameter<On, T extends string = string> = Row<On, T> & {
  readonly kind: "choice";
  readonly values: readonly T[];
  readonly names: Readonly<Record<T, string>>;
  /** Values that can be chosen now; absent: all. */
  readonly options?: (on: On) => readonly T[];
  /** Whether the choices open as a list, because their names are long. Other choices stand side by side. */
  readonly isListed?: boolean;
  /** Key of the keyboard that sets the next of the values. */
  readonly key?: KeyWords;
  /** A value that depends on the user's own file: no link has it, and no key leads to it. */
  readonly ownValue?: T;
  /** Returns why this device does not support a value; null: it does. */
  fault?(on: On, value: T): string | null;
};

export type ColourParameter<On> = Row<On, Rgb> & Readonly<{ kind: "colour" }>;

export type Parameter<On> =
  | NumberParameter<On>
  | SwitchParameter<On>
  | ChoiceParameter<On>
  | ColourParameter<On>;

/** `channel`: id of the channel that the parameter belongs to; absent: it belongs to no channel. */
export type SetAction = Readonly<{ type: "set"; id: string; value: Value; channel?: string }>;

/** Returns the action that gives a parameter a value. */
export function setTo<T extends Value>(
  { id }: Readonly<{ id: string; get: (on: never) => T }>,
  value: T,
  channel?: string,
): SetAction {
  return channel === undefined ? { type: "set", id, value } : { type: "set", id, value, channel };
}

type Lens<On, T> = Readonly<{ get: (on: On) => T }> & { set<S extends On>(on: S, value: T): S };

/** Returns functions that read and write a field. */
export function lensesOf<On>(): <K extends keyof On & string>(name: K) => Lens<On, On[K]> {
  return (name) => ({
    get: (on) => on[name],
    set: (on, value) => ({ ...on, [name]: value }),
  });
}

/** Returns the value within the limits; null if the parameter has no such value. */
function accepted<On>(row: Parameter<On>, value: Value): Value | null {
  switch (row.kind) {
    case "number": {
      const [low, high] = row.limits;
      if (typeof value !== "number" || !Number.isFinite(value)) return null;
      return Math.min(high, Math.max(low, value));
    }
    case "switch":
      return typeof value === "boolean" ? value : null;
    case "choice":
      return row.values.find((each) => each === value) ?? null;
    case "colour":
      return typeof value === "object" && value.every(Number.isFinite) ? value : null;
  }
}

/** Returns the object with the parameter set: the same object if that changes nothing. */
export function withValue<On>(row: Parameter<On>, on: On, value: Value): On {
  const next = accepted(row, value);
  if (next === null || next === row.get(on)) return on;
  // each kind accepts only values of its own type
  return (row.set as (on: On, value: Value) => On)(on, next);
}

/** Returns the position of a value between the smallest and the largest one, 0..1, for a slider. */
export function shareOf<On>(
  { limits: [low, high], isLogarithmic }: NumberParameter<On>,
  value: number,
): number {
  if (isLogarithmic) return Math.log(value / low) / Math.log(high / low);
  return (value - low) / (high - low);
}

export function valueAtShare<On>(
  { limits: [low, high], isLogarithmic, rounded }: NumberParameter<On>,
  share: number,
): number {
  return rounded(isLogarithmic ? low * (high / low) ** share : low + (high - low) * share);
}

/** Returns the choices that are available now. */
export function optionsOf<On, T extends string>(
  { values, options }: ChoiceParameter<On, T>,
  on: On,
): readonly T[] {
  return options?.(on) ?? values;
}
