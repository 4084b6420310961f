/** The keys of where volumes show, and how finely. Pure. */
import { QUALITY_PARAMETERS } from "../../state/parameters/tools";
import { VOLUMES } from "../../state/parameters/volumes";
import { type Key, keysOf } from "../key";

export const VOLUME_KEYS: readonly Key[] = [...VOLUMES, ...QUALITY_PARAMETERS].flatMap(keysOf);
