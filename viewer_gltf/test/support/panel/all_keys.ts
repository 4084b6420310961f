/** The keys of the whole viewer, with those of all parts. */
import { KeyTable, OWN_KEYS } from "../../../src/panel/keys";
import { PARTS } from "../all_parts";

export { NO_SLICES } from "../../../src/slices/settings";

export const KEYS = new KeyTable([...OWN_KEYS, ...PARTS.flatMap(({ keys = [] }) => keys)]);
