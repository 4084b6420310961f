/** All settings, but for those of the channels, in a bundle that has just opened. Their rows are in table.ts. Pure. */
import { START_LIGHT } from "./light";
import { START_SLICES } from "./slices";
import { START_TOOLS } from "./tools";
import { START_VOLUMES } from "./volumes";

export const START_SETTINGS = { ...START_VOLUMES, ...START_TOOLS, ...START_LIGHT, ...START_SLICES };

export type Settings = Readonly<typeof START_SETTINGS>;
