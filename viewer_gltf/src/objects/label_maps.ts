/** The keys and the panel's sections of label maps, until and while their tables are there. Pure. */
import type { PartSection, Section } from "../panel/controls";
import { type KeyGroup, key } from "../panel/key";
import { labelMapsOf, objectsSection } from "../panel/layout";
import type { ViewerState } from "../state/viewer_state";

export const OBJECT_COMMANDS = [
  /** The objects of a label map that are selected, or that show, as a file. */
  "save-objects",
] as const;

declare module "../state/commands" {
  interface CommandNames extends Record<(typeof OBJECT_COMMANDS)[number], true> {}
}

/** A label map that is shown has its section from the start, so that no row moves when its table has come. */
const LOADING: Section["items"] = [
  { kind: "text", id: "objects-loading", label: "Objects", value: "loading …" },
];

/** @param made the controls of the label maps whose tables have come, by channel */
export function labelMapSections(
  state: ViewerState,
  made: ReadonlyMap<string, Section["items"]>,
  isInRoom: boolean,
): readonly PartSection[] {
  return labelMapsOf(state).map(({ id, name }, _, { length }) => ({
    id: objectsSection(id, length),
    label: length === 1 ? "Objects" : `Objects: ${name}`,
    rank: 20,
    items: made.get(id) ?? (isInRoom ? [] : LOADING),
  }));
}

export const OBJECT_KEYS: readonly KeyGroup[] = [
  {
    name: "Tools",
    rank: 76,
    keys: [
      key("Insert", "Save the objects that are selected, or that show, as CSV", "save-objects"),
    ],
  },
];
