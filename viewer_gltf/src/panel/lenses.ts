/** Cardboard viewers with known lens profiles, and one of the user's own. */
import type { Lenses } from "./controls";

export const LENS_NAMES: Readonly<Record<Lenses, string>> = {
  v1: "Cardboard v1 (2014)",
  v2: "Cardboard v2 (2015)",
  own: "another viewer",
};
export const LENSES = ["v1", "v2", "own"] as const;
