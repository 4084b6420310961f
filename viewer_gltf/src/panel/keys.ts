/** Every key: the sections' lists, in the order of the list that `?` opens. Pure. */

import { REFUSED } from "../state/refusals";
import { hasVolumes } from "../state/viewer_state";
import type { Refusal, Wish } from "./controls";
import { type Key, type KeyContext, type KeyGroup, no } from "./key";
import { CHANNEL_KEYS } from "./sections/channel_keys";
import { LIGHT_KEYS } from "./sections/path_trace_keys";
import { SAVE_KEYS } from "./sections/save";
import { SLICE_KEYS } from "./sections/slice_keys";
import { TILE_KEYS } from "./sections/tile_keys";
import { TOOL_KEYS } from "./sections/tool_keys";
import { SHAPE_KEYS } from "./sections/transfer_function_2d_keys";
import { VIEW_KEYS } from "./sections/view_keys";
import { VOLUME_KEYS } from "./sections/volume_keys";

export const KEYS: readonly KeyGroup[] = [
  { name: "View", keys: VIEW_KEYS },
  { name: "Channels", keys: CHANNEL_KEYS },
  { name: "Value and gradient", keys: SHAPE_KEYS },
  { name: "Volumes", keys: VOLUME_KEYS },
  { name: "Slices", keys: SLICE_KEYS },
  { name: "Path tracing", keys: LIGHT_KEYS },
  { name: "Tiles", keys: TILE_KEYS },
  { name: "Tools", keys: TOOL_KEYS },
  { name: "Pictures and video", keys: SAVE_KEYS },
];

const BY_KEY: ReadonlyMap<string, Key> = new Map(
  KEYS.flatMap(({ keys }) =>
    keys.flatMap((each) => each.keys.map((name) => [name, each] as const)),
  ),
);

const OF_VOLUMES: ReadonlySet<Key> = new Set([...VOLUME_KEYS, ...SLICE_KEYS, ...LIGHT_KEYS]);
const NO_VOLUMES = no(REFUSED.volumes);

/** Keys that a reader has changed: from a name in these tables to the key that is pressed instead. */
export type KeyChanges = Readonly<Record<string, string>>;

/** The name in these tables that a pressed key stands for; null: none. */
export function standsFor(pressed: string, changes: KeyChanges): string | null {
  const changed = Object.keys(changes).find((name) => changes[name] === pressed);
  if (changed !== undefined) return changed;
  return BY_KEY.has(pressed) && !Object.hasOwn(changes, pressed) ? pressed : null;
}

/** A sentence that names keys in brackets, with the keys that a reader has set instead. */
export function withKeys(text: string, changes: KeyChanges): string {
  return text.replace(/\((.)\)/g, (_, name: string) => `(${changes[name] ?? name})`);
}

/** The words for a key, as the list of keys has them. */
export function labelOf(name: string): string {
  return BY_KEY.get(name)?.label ?? "";
}

/** What a key asks for, or why it does nothing now; null: there is no such key. */
export function wishOf(name: string, context: KeyContext): Wish | Refusal | null {
  const found = BY_KEY.get(name);
  if (found === undefined) return null;
  const isVain = OF_VOLUMES.has(found) && !hasVolumes(context.state);
  return isVain ? NO_VOLUMES : found.to(context, name);
}
