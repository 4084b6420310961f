/**
 * Adapts messages of the readers to this page. Pure.
 *
 * A message may name a setting by its flag on the command line, such as `--spacing-um z,y,x`. If this page has a field
 * for the setting, the field's name replaces the flag. Other flags are shown with the command that takes them.
 */
import { BACKGROUNDS, NAMES, PRESETS } from "./setting_names";

/** Returns the name of a field with one of its values; `value` is empty if the flag has none. */
type Namer = (value: string) => string;

/** Names a setting without its value, which only has a form for the command line, such as `z,y,x`. */
const alone =
  (name: string): Namer =>
  () =>
    quoted(name);

const FIELDS: Readonly<Record<string, Namer>> = {
  title: alone(NAMES.title),
  channels: alone(NAMES.channels),
  "spacing-um": alone(NAMES.spacing),
  preset: (value) =>
    quoted(isPlaceholder(value) ? NAMES.preset : `${NAMES.preset}: ${PRESETS[value] ?? value}`),
  series: (value) =>
    value === "list"
      ? `the list ${quoted(NAMES.series)}`
      : quoted(isPlaceholder(value) ? NAMES.series : `${NAMES.series}: ${value}`),
  dark: () => quoted(`${NAMES.background}: ${BACKGROUNDS.bright}`),
};

const quoted = (name: string) => `"${name}"`;
const isPlaceholder = (value: string) => value === "" || /^[A-Z]+$/.test(value);

/** Values that may follow a flag in messages: lengths, numbers, axes, placeholders and a few words. */
const VALUE = [
  "\\d+=[^\\s`;,)]+",
  "\\.(?= )",
  "[\\w.?]+(?:,[\\w.?]+)+",
  "\\d+(?:\\.\\d+)?",
  "[xyzct]{2,5}",
  "[A-Z][A-Z_]*",
  ...["list", "intensity", "hounsfield", ...Object.keys(PRESETS)],
].join("|");
const FLAG = `--[a-z][a-z-]*(?: (?:${VALUE})(?![\\w-]))?`;
/** Flags that follow one another, with the command before them or the quotes around them. */
const FLAGS = new RegExp(`(?<![\\w-])(stereocell [a-z]+ |\`)?(${FLAG}(?: ${FLAG})*)\`?`, "g");

export function inPageWords(line: string): string {
  return line.replace(FLAGS, (whole, before: string | undefined, flags: string) => {
    const words = [...flags.matchAll(new RegExp(FLAG, "g"))].map(([found]) => {
      const [flag, value = ""] = found.slice(2).split(" ");
      return FIELDS[flag]?.(value);
    });
    if (words.every((each) => each !== undefined)) return words.join(" and ");
    return before?.startsWith("stereocell") ? whole : `\`stereocell build ${flags}\``;
  });
}
