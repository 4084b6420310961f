/**
 * What the page's address asks for: `mode` (disc, tile, all, stage, traced, off), `quality` (auto, low,
 * high), `switch` (metres of the room), `disc` (degrees). Pure.
 */

import type { Action } from "../state/actions";
import { QUALITY_LEVELS } from "../state/quality_controller";
import { MODES } from "../state/viewer_state";

/** Their names: a link to a view leaves them out, it has them itself. */
export const SETTINGS = ["mode", "quality", "switch", "disc"] as const;

/** The actions that bring a state there; what can't be read is told by one more. */
export function settingsOf(search: string): readonly Action[] {
  const asked = new URLSearchParams(search);
  const actions: Action[] = [];
  const refuse = (name: string, text: string, expected: string) =>
    actions.push({ type: "notify", text: `address: ${name}: expected ${expected}, found ${text}` });
  const choice = <T extends string>(
    name: string,
    values: readonly T[],
    action: (value: T) => Action,
  ) => {
    const text = asked.get(name);
    if (text === null) return;
    const value = values.find((each) => each === text);
    if (value !== undefined) actions.push(action(value));
    else refuse(name, text, `one of ${values.join(", ")}`);
  };
  const number = (name: string, action: (value: number) => Action) => {
    const text = asked.get(name);
    if (text === null) return;
    const value = Number(text);
    if (text.trim() !== "" && Number.isFinite(value)) actions.push(action(value));
    else refuse(name, text, "a number");
  };
  choice("mode", MODES, (mode) => ({ type: "choose-mode", mode }));
  choice("quality", QUALITY_LEVELS, (level) => ({ type: "choose-quality", level }));
  number("switch", (distance_m) => ({ type: "set-switch-distance", distance_m }));
  number("disc", (radius_deg) => ({ type: "set-disc-radius", radius_deg }));
  return actions;
}
