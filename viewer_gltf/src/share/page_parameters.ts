/**
 * Reads the settings in the page's address. Pure.
 *
 * - `mode`: disc, tile, all, stage, traced or off
 * - `quality`: auto, low or high
 * - `switch`: volume distance, m of the scene
 * - `disc`: radius of the focus disc, degrees
 * - `stereo`: off, anaglyph or side-by-side
 * - `view`: front, side or top
 * - `panel`: off
 * - `theme`: light or dark
 * - `backdrop`: plain
 */
import { NAMED_VIEWS, type NamedView } from "../interaction/named_views";
import type { Action } from "../state/actions";
import { type Parameter, setTo, type Value } from "../state/parameters/kinds";
import { parametersInAddress } from "../state/parameters/table";
import type { ViewerState } from "../state/viewer_state";

/** Names of the settings. A link to a view removes them from the page's address, since it contains their values. */
export const settingNames = (): readonly string[] => [
  ...parametersInAddress().flatMap(({ link }) => link ?? []),
  "view",
];

/** Returns the named view with which the page opens; null for the default one. */
export function standOf(search: string): NamedView | null {
  const asked = new URLSearchParams(search).get("view");
  return NAMED_VIEWS.find((stand) => stand === asked) ?? null;
}

/** Returns whether the page has a panel. `panel=off` removes it, for use in another page's frame. */
export function panelOf(search: string): "on" | "off" {
  return new URLSearchParams(search).get("panel") === "off" ? "off" : "on";
}

/** Returns whether the page and its background are light: by `theme=`, otherwise by the system's setting. */
export function isLight(search: string, isSystemLight: boolean): boolean {
  const asked = new URLSearchParams(search).get("theme");
  return asked === "light" || (asked !== "dark" && isSystemLight);
}

/** Returns whether the background has one colour: with `backdrop=plain`, or if the user prefers more contrast. */
export function isPlain(search: string, asksForContrast: boolean): boolean {
  return asksForContrast || new URLSearchParams(search).get("backdrop") === "plain";
}

/** Returns the value for a text; null if the parameter has no such value. */
function valueIn(row: Parameter<ViewerState>, text: string): Value | null {
  if (row.kind === "choice") return row.values.find((each) => each === text) ?? null;
  const value = Number(text);
  return text.trim() !== "" && Number.isFinite(value) ? value : null;
}

/** Returns the actions that apply the settings, and one that reports unreadable settings. */
export function settingsOf(search: string): readonly Action[] {
  const asked = new URLSearchParams(search);
  return parametersInAddress().flatMap((row): readonly Action[] => {
    const name = row.link ?? row.id;
    const text = asked.get(name);
    if (text === null) return [];
    const value = valueIn(row, text);
    if (value !== null) return [setTo<Value>(row, value)];
    const expected = row.kind === "choice" ? `one of ${row.values.join(", ")}` : "a number";
    return [
      {
        type: "notify",
        text: `Address: ${name} is ${text === "" ? "empty" : text}, expected ${expected}`,
      },
    ];
  });
}
