/**
 * What the page's address asks for: `mode` (disc, tile, all, stage, off), `switch` (metres of the
 * room), `disc` (degrees). Pure.
 */
import { type Action, MODES, type Mode } from "../state";

const isMode = (text: string): text is Mode => (MODES as readonly string[]).includes(text);

/** The actions that bring a state there; what can't be read is told by one more. */
export function settingsOf(search: string): readonly Action[] {
  const asked = new URLSearchParams(search);
  const actions: Action[] = [];
  const refuse = (name: string, text: string, expected: string) =>
    actions.push({ type: "notify", text: `address: ${name}: expected ${expected}, found ${text}` });
  const mode = asked.get("mode");
  if (mode !== null) {
    if (isMode(mode)) actions.push({ type: "choose-mode", mode });
    else refuse("mode", mode, `one of ${MODES.join(", ")}`);
  }
  const number = (name: string, action: (value: number) => Action) => {
    const text = asked.get(name);
    if (text === null) return;
    const value = Number(text);
    if (text.trim() !== "" && Number.isFinite(value)) actions.push(action(value));
    else refuse(name, text, "a number");
  };
  number("switch", (distance_m) => ({ type: "set-switch-distance", distance_m }));
  number("disc", (radius_deg) => ({ type: "set-disc-radius", radius_deg }));
  return actions;
}
