/** Titles of transfer functions: those that a build makes, and the user's own. Pure. */
import { PRESET_TITLES } from "../bundle/generated/preset_titles";
import { type Functions, isTwoD, OWN } from "../state/transfer_functions_2d";

const TITLES: Readonly<Record<string, string>> = { ...PRESET_TITLES, [OWN]: "Your own shapes" };

/** The title of a function; the name itself where an artist has given the function a name. */
export function titleOf(name: string): string {
  return Object.hasOwn(TITLES, name) ? TITLES[name] : name;
}

/** The title of one of a channel's functions, which also says whether the function is two-dimensional. */
export function transferTitle(functions: Functions, name = functions.transferFunction): string {
  return isTwoD(functions, name) ? `${titleOf(name)} (2D)` : titleOf(name);
}
