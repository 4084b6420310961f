/** Shapes of controls that several sections of the panel have. Pure. */
import type { Command } from "../state/commands";
import type { Button, Choice } from "./controls";

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
