/** Titles of transfer functions: those of the presets, and of the user's own. Pure. */
import { PRESET_TITLES } from "../bundle/generated/preset_titles";
import { type Functions, isTwoD, OWN } from "../state/transfer_functions_2d";

const TITLES: Readonly<Record<string, string>> = { ...PRESET_TITLES, [OWN]: "Your own shapes" };

/** Returns the title of a function: the name itself if the author of the stage has named it. */
export function titleOf(name: string): string {
  return Object.hasOwn(TITLES, name) ? TITLES[name] : name;
}

/** Returns the title of a function of a channel, with a mark if it is two-dimensional. */
export function transferTitle(functions: Functions, name = functions.transferFunction): string {
  return isTwoD(functions, name) ? `${titleOf(name)} (2D)` : titleOf(name);
}
