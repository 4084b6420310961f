/**
 * What a parameter is: a number, a switch, a choice or a colour that a user sets, as one row of a
 * table. Panels, keys, links, the page's address and spoken words are made from its row. Pure.
 */
import type { Rgb } from "../../math/color";

export type Value = number | boolean | string | Rgb;

/** A key and its text in the list of keys. */
type KeyWords = readonly [key: string, label: string];

/** `On`: what of the state it is of. */
type Row<On, T extends Value> = Readonly<{
  /** Of the panel's control, and of the action that sets it. */
  id: string;
  label: string;
  /** The label where nothing around names its subject. */
  name?: (on: On) => string;
  /** Its name in a link; absent: it is in none. */
  link?: string;
  /** Why the panel can't set it now; "": it can. */
  refusal?: (on: On) => string;
  /** What it does, in a sentence, where its name can't say it. */
  about?: string;
  get: (on: On) => T;
  /** The announcement once a key has set it. */
  spoken: (on: On) => string;
}> & {
  /** @param value one that `accepted` gives back */
  set<S extends On>(on: S, value: T): S;
};

export type NumberParameter<On> = Row<On, number> &
  Readonly<{
    kind: "number";
    limits: readonly [number, number];
    /** From one end of a slider to the other. */
    steps: number;
    /** Equal steps are equal factors. */
    isLogarithmic?: boolean;
    /** A slider's value, with as many digits as a step needs: more would lengthen a link. */
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
  /** Those that can be chosen now; absent: all. */
  readonly options?: (on: On) => readonly T[];
  /** Long names: a list to open, where others stand side by side. */
  readonly isListed?: boolean;
  /** The key for the next one. */
  readonly key?: KeyWords;
  /** A value that stays with the user: no link has it, no key leads to it. */
  readonly ownValue?: T;
  /** Why a value can't be had on this device; null: it can. */
  fault?(on: On, value: T): string | null;
};

export type ColourParameter<On> = Row<On, Rgb> & Readonly<{ kind: "colour" }>;

export type Parameter<On> =
  | NumberParameter<On>
  | SwitchParameter<On>
  | ChoiceParameter<On>
  | ColourParameter<On>;

/** `channel`: the id of the one that it is of; absent: it is no channel's. */
export type SetAction = Readonly<{ type: "set"; id: string; value: Value; channel?: string }>;

/** The action that gives a parameter another value. */
export function setTo<T extends Value>(
  { id }: Readonly<{ id: string; get: (on: never) => T }>,
  value: T,
  channel?: string,
): SetAction {
  return channel === undefined ? { type: "set", id, value } : { type: "set", id, value, channel };
}

type Lens<On, T> = Readonly<{ get: (on: On) => T }> & { set<S extends On>(on: S, value: T): S };

/** How a field is read and written. */
export function lensesOf<On>(): <K extends keyof On & string>(name: K) => Lens<On, On[K]> {
  return (name) => ({
    get: (on) => on[name],
    set: (on, value) => ({ ...on, [name]: value }),
  });
}

/** What is set where a value is asked for: within the limits; null: it is none of the parameter's. */
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

/** With the parameter set; the same where that changes nothing. */
export function withValue<On>(row: Parameter<On>, on: On, value: Value): On {
  const next = accepted(row, value);
  if (next === null || next === row.get(on)) return on;
  // each kind accepts values of its own type alone
  return (row.set as (on: On, value: Value) => On)(on, next);
}

/** Where a value is between the ends, 0..1. */
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

/** The choices that are offered now. */
export function optionsOf<On, T extends string>(
  { values, options }: ChoiceParameter<On, T>,
  on: On,
): readonly T[] {
  return options?.(on) ?? values;
}
