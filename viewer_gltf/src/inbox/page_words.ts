/**
 * Lines of the readers in words of this page. Pure.
 *
 * A line may name a setting by its flag on the command line, as `--spacing-um z,y,x`. The page has fields for some of
 * them, and names these. A flag without a field is named with the command that takes it.
 */
import { BACKGROUNDS, NAMES, PRESETS } from "./setting_names";

/** How a field and one of its values are named; `value` is empty where the flag stands by itself. */
type Namer = (value: string) => string;

/** A setting's name alone: a value in a line is a form for the command line, as `z,y,x`, or a placeholder. */
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

/** Values that stand after a flag in lines: lengths, numbers, axes, placeholders and a few words. */
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
/** Flags that follow each other, with the command or the quotes around them. */
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
