/**
 * All settings but those of the channels, in a bundle that has just opened. Their rows are in
 * table.ts. A part adds its settings by `declare module`; its definition has their rows. Pure.
 */
import { type LightSettings, START_LIGHT } from "./light";
import { START_TOOLS, type ToolSettings } from "./tools";
import { START_VOLUMES, type VolumeSettings } from "./volumes";

export interface Settings extends VolumeSettings, ToolSettings, LightSettings {}

/** Opening values of all settings but those of parts. */
export const START_SETTINGS = { ...START_VOLUMES, ...START_TOOLS, ...START_LIGHT };

export type SettingsOfParts = Omit<Settings, keyof typeof START_SETTINGS>;
