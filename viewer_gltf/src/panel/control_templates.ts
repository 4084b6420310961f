/** Shapes of controls that several sections of the panel have. Pure. */
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

/** A button that asks for a command; its id is the command. */
export function command(id: Command, label: string): Button {
  return { kind: "button", id, label, to: () => id };
}

/** One of a few, side by side. */
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

/** What of a parameter's row every control has. @param channel the id of the one that it is of */
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
 * The control of a parameter: a slider, a toggle, a choice, or a field for any colour.
 *
 * @param channel the id of the one that it is of
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

/** A field for any colour. @param shows what it shows instead of its own; none: nothing else */
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

/** A colour by the palettes: beside the field for any colour, which has another id. */
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
