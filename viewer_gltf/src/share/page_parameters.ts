/**
 * What the page's address asks for: `mode` (disc, tile, all, stage, traced, off), `quality` (auto, low,
 * high), `switch` (metres of the room), `disc` (degrees), `stereo` (off, anaglyph, side-by-side), `view` (front,
 * side, top), `panel` (off), `theme` (light, dark), `backdrop` (plain). Pure.
 */
import { NAMED_VIEWS, type NamedView } from "../interaction/named_views";
import type { Action } from "../state/actions";
import { type Parameter, setTo, type Value } from "../state/parameters/kinds";
import { parametersInAddress } from "../state/parameters/table";
import type { ViewerState } from "../state/viewer_state";

/** Their names: a link to a view leaves them out, it has them itself. */
export const settingNames = (): readonly string[] => [
  ...parametersInAddress().flatMap(({ link }) => link ?? []),
  "view",
];

/** The view that the page opens with; null: the usual one. */
export function standOf(search: string): NamedView | null {
  const asked = new URLSearchParams(search).get("view");
  return NAMED_VIEWS.find((stand) => stand === asked) ?? null;
}

/** Whether the page has a panel: `panel=off` leaves it out, for a page that holds this one in a frame. */
export function panelOf(search: string): "on" | "off" {
  return new URLSearchParams(search).get("panel") === "off" ? "off" : "on";
}

/** Whether the page and its background are light: as `theme=` says, or else as the system has it. */
export function isLight(search: string, isSystemLight: boolean): boolean {
  const asked = new URLSearchParams(search).get("theme");
  return asked === "light" || (asked !== "dark" && isSystemLight);
}

/** Whether the background is of one colour: as `backdrop=plain` says, or for a reader who asks for more contrast. */
export function isPlain(search: string, asksForContrast: boolean): boolean {
  return asksForContrast || new URLSearchParams(search).get("backdrop") === "plain";
}

/** null: none of the parameter's. */
function valueIn(row: Parameter<ViewerState>, text: string): Value | null {
  if (row.kind === "choice") return row.values.find((each) => each === text) ?? null;
  const value = Number(text);
  return text.trim() !== "" && Number.isFinite(value) ? value : null;
}

/** The actions that bring a state there; one more reports unreadable settings. */
export function settingsOf(search: string): readonly Action[] {
  const asked = new URLSearchParams(search);
  return parametersInAddress().flatMap((row): readonly Action[] => {
    const name = row.link ?? row.id;
    const text = asked.get(name);
    if (text === null) return [];
    const value = valueIn(row, text);
    if (value !== null) return [setTo<Value>(row, value)];
    const expected = row.kind === "choice" ? `one of ${row.values.join(", ")}` : "a number";
    return [{ type: "notify", text: `address: ${name}: expected ${expected}, found ${text}` }];
  });
}
