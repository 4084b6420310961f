/** Controls that several sections of the panel make in the same way. Pure. */
import { fromHex, toHex } from "../math/color";
import type { Command } from "../state/commands";
import {
  type ColourParameter,
  optionsOf,
  type Parameter,
  setTo,
  shareOf,
  valueAtShare,
} from "../state/parameters/kinds";
import type { Button, Choice, Colour, Control } from "./controls";
import { PALETTES } from "./palettes";

/** Returns a button that requests a command; its id is the command. */
export function command(id: Command, label: string): Button {
  return { kind: "button", id, label, to: () => id };
}

/** Returns a choice between a few options, side by side. */
export function inline<T extends string>(
  id: string,
  label: string,
  value: T,
  names: Readonly<Record<T, string>>,
  values: readonly T[],
  to: (value: T) => ReturnType<Choice["to"]>,
): Choice {
  return {
    kind: "choice",
    id,
    label,
    value,
    options: values.map((each) => ({ value: each, label: names[each] })),
    isInline: true,
    to: (chosen) => to(values.find((each) => each === chosen) ?? value),
  };
}

/**
 * Returns the fields that every control takes from its parameter's row. @param channel id of the
 * parameter's channel
 */
function baseOf<On>(row: Parameter<On>, on: On, channel?: string) {
  return {
    id: channel === undefined ? row.id : `${channel}/${row.id}`,
    label: row.label,
    ...(row.name === undefined ? {} : { name: row.name(on) }),
    ...(row.about === undefined ? {} : { about: row.about }),
    ...(row.refusal === undefined ? {} : { refusal: row.refusal(on) }),
  };
}

/**
 * Returns the control of a parameter: a slider, a toggle, a choice, or a field for any colour.
 *
 * @param channel id of the parameter's channel; absent: it belongs to no channel
 */
export function controlOf<On>(row: Parameter<On>, on: On, channel?: string): Control {
  const base = baseOf(row, on, channel);
  switch (row.kind) {
    case "number": {
      const value = row.get(on);
      return {
        ...base,
        kind: "slider",
        value: shareOf(row, value),
        steps: row.steps,
        text: row.text(value),
        to: (share) => setTo(row, valueAtShare(row, share), channel),
      };
    }
    case "switch":
      return {
        ...base,
        kind: "toggle",
        value: row.get(on),
        to: (value) => setTo(row, value, channel),
      };
    case "choice": {
      const to = (value: string) => setTo(row, value, channel);
      return {
        ...base,
        ...inline(base.id, row.label, row.get(on), row.names, optionsOf(row, on), to),
        isInline: row.isListed !== true,
      };
    }
    case "colour":
      return colourOf(row, on, channel);
  }
}

/** Returns a field for any colour. @param shows colours that are shown in its place; empty: its own */
export function colourOf<On>(
  row: ColourParameter<On>,
  on: On,
  channel?: string,
  shows: readonly string[] = [],
): Colour {
  return {
    ...baseOf(row, on, channel),
    label: "Any colour",
    kind: "colour",
    shows,
    value: toHex(row.get(on)),
    palettes: [],
    to: (hex) => setTo(row, fromHex(hex), channel),
  };
}

/** Returns a choice from the palettes. It has another id than the field for any colour beside it. */
export function paletteOf<On>(
  row: ColourParameter<On>,
  on: On,
  id: string,
  channel?: string,
): Control {
  return { ...colourOf(row, on, channel), label: row.label, id, palettes: PALETTES };
}

export function controlsOf<On>(rows: readonly Parameter<On>[], on: On): readonly Control[] {
  return rows.map((row) => controlOf(row, on));
}
