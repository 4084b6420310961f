/** The keys and the panel's sections of label maps, before and after their tables have loaded. Pure. */
import type { PartSection, Section } from "../panel/controls";
import { type KeyGroup, key } from "../panel/key";
import { labelMapsOf, objectsSection } from "../panel/layout";
import type { ViewerState } from "../state/viewer_state";

export const OBJECT_COMMANDS = [
  /** Saves the selected objects of each label map as a file, or all shown objects if none is selected. */
  "save-objects",
] as const;

declare module "../state/commands" {
  interface CommandNames extends Record<(typeof OBJECT_COMMANDS)[number], true> {}
}

/** Contents of the section of a shown label map until its table has loaded, so that later rows do not move. */
const LOADING: Section["items"] = [
  { kind: "text", id: "objects-loading", label: "Objects", value: "loading …" },
];

/** @param made controls of the label maps whose tables have loaded, by channel ID */
export function labelMapSections(
  state: ViewerState,
  made: ReadonlyMap<string, Section["items"]>,
  isInStereo: boolean,
): readonly PartSection[] {
  return labelMapsOf(state).map(({ id, name }, _, { length }) => ({
    id: objectsSection(id, length),
    label: length === 1 ? "Objects" : `Objects: ${name}`,
    rank: 20,
    items: made.get(id) ?? (isInStereo ? [] : LOADING),
  }));
}

export const OBJECT_KEYS: readonly KeyGroup[] = [
  {
    name: "Tools",
    rank: 76,
    keys: [
      key("Insert", "Save the selected objects, or all shown objects, as CSV", "save-objects"),
    ],
  },
];
