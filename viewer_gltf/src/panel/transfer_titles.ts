/** Titles of the transfer functions that a build makes: each says what one will see. Pure. */
import { type Functions, isTwoD, OWN } from "../state/transfer_functions_2d";

const TITLES: Readonly<Record<string, string>> = {
  default: "Translucent bodies",
  soft: "Thin veil",
  sharp: "Solid bodies",
  surface: "Thin shell",
  threshold: "All above the threshold",
  arcs: "Boundaries of materials",
  heat: "Heat colours",
  grey: "Shades of grey",
  tissues: "Tissues in colour",
  air: "Air",
  fat: "Fat",
  soft_tissue: "Soft tissue",
  blood: "Blood",
  bone: "Bone",
  [OWN]: "Your own shapes",
};

/** The title of a function; the name itself where an artist has given the function a name. */
export function titleOf(name: string): string {
  return Object.hasOwn(TITLES, name) ? TITLES[name] : name;
}

/** The title of one of a channel's functions, which also says whether the function is two-dimensional. */
export function transferTitle(functions: Functions, name = functions.transferFunction): string {
  return isTwoD(functions, name) ? `${titleOf(name)} (2D)` : titleOf(name);
}
