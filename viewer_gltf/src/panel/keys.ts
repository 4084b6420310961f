/** All keys: the groups of the panel and of the parts, in the order of the list that `?` opens. Pure. */

import { QUALITY_PARAMETERS } from "../state/parameters/tools";
import { REFUSED } from "../state/refusals";
import { hasVolumes } from "../state/viewer_state";
import type { Refusal, Request } from "./controls";
import { type Key, type KeyContext, type KeyGroup, keysOf, no } from "./key";
import { TOOL_KEYS } from "./tool_keys";
import { VIEW_KEYS } from "./view_keys";

/** Keys that every viewer has. */
export const OWN_KEYS: readonly KeyGroup[] = [
  { name: "View", rank: 10, keys: VIEW_KEYS },
  // the quality of volumes follows the keys that decide where they are shown
  { name: "Volumes", rank: 41, keys: QUALITY_PARAMETERS.flatMap(keysOf), needsVolumes: true },
  { name: "Tools", rank: 80, keys: TOOL_KEYS },
];

/** Keys that a user has changed: from a name in these tables to the key that is pressed instead. */
export type KeyChanges = Readonly<Record<string, string>>;

/** Replaces the keys in brackets in a sentence by those that the user has set instead. */
export function withKeys(text: string, changes: KeyChanges): string {
  return text.replace(/\((.)\)/g, (_, name: string) => `(${changes[name] ?? name})`);
}

const NO_VOLUMES = no(REFUSED.volumes);

type Entry = Readonly<{ key: Key; needsVolumes: boolean }>;

export class KeyTable {
  /** Groups of keys; groups with the same name are joined. */
  readonly groups: readonly KeyGroup[];
  private readonly byName: ReadonlyMap<string, Entry>;

  constructor(groups: readonly KeyGroup[]) {
    const sorted = groups.toSorted((a, b) => a.rank - b.rank);
    const names = [...new Set(sorted.map(({ name }) => name))];
    this.groups = names.map((name) => {
      const parts = sorted.filter((group) => group.name === name);
      return { ...parts[0], keys: parts.flatMap(({ keys }) => keys) };
    });
    this.byName = new Map(
      sorted.flatMap(({ keys, needsVolumes = false }) =>
        keys.flatMap((key) => key.keys.map((name) => [name, { key, needsVolumes }] as const)),
      ),
    );
  }

  /**
   * Returns the name, in the tables, of the key whose function a pressed key has; null: the pressed
   * key has no function.
   */
  standsFor(pressed: string, changes: KeyChanges): string | null {
    const changed = Object.keys(changes).find((name) => changes[name] === pressed);
    if (changed !== undefined) return changed;
    return this.byName.has(pressed) && !Object.hasOwn(changes, pressed) ? pressed : null;
  }

  /** Returns the label of a key in the list of keys. */
  labelOf(name: string): string {
    return this.byName.get(name)?.key.label ?? "";
  }

  /** Returns the request of a key, or why it has no effect now; null: there is no such key. */
  requestOf(name: string, context: KeyContext): Request | Refusal | null {
    const found = this.byName.get(name);
    if (found === undefined) return null;
    const isUseless = found.needsVolumes && !hasVolumes(context.state);
    return isUseless ? NO_VOLUMES : found.key.to(context, name);
  }
}
