/**
 * All settings, but for those of the channels, in a bundle that has just opened. Their rows are in table.ts. A part adds
 * its own settings by `declare module`, and their rows in its definition. Pure.
 */
import { type LightSettings, START_LIGHT } from "./light";
import { START_TOOLS, type ToolSettings } from "./tools";
import { START_VOLUMES, type VolumeSettings } from "./volumes";

export interface Settings extends VolumeSettings, ToolSettings, LightSettings {}

/** Besides those of parts. */
export const START_SETTINGS = { ...START_VOLUMES, ...START_TOOLS, ...START_LIGHT };

export type SettingsOfParts = Omit<Settings, keyof typeof START_SETTINGS>;
