import { type KeyGroup, keysOf } from "../panel/key";
import { VOLUMES } from "../state/parameters/volumes";

export const VOLUME_KEYS: readonly KeyGroup[] = [
  { name: "Volumes", rank: 40, keys: VOLUMES.flatMap(keysOf), needsVolumes: true },
];
