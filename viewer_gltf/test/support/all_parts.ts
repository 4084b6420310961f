/**
 * The parts of the viewer. Importing this module adds their settings to the state, as the host does
 * before it makes a state.
 */
import * as parts from "../../src/app/parts";
import type { PartDefinition } from "../../src/host/part";
import { addSettings } from "../../src/state/part_settings";

export const PARTS: readonly PartDefinition[] = Object.values(parts);

for (const { id, settings } of PARTS) if (settings !== undefined) addSettings(id, settings);
