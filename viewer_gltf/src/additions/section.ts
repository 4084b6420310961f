/** The panel's section for additions, which a layer of the stage adds to the specimen, and its key. Pure. */
import type { Manifest } from "../bundle/generated/bundle";
import type { Control, PartSection } from "../panel/controls";
import { type KeyGroup, key, no } from "../panel/key";
import type { AdditionSettings } from "./settings";

export function additionSections(
  { additions }: Manifest,
  { hiddenAdditions: hidden }: Pick<AdditionSettings, "hiddenAdditions">,
): readonly PartSection[] {
  if (additions === undefined) return [];
  const items = additions.layers.map(
    ({ id, name }, i): Control => ({
      kind: "toggle",
      id: `addition-${i}`,
      label: name,
      value: !hidden.includes(id),
      to: (shown) => ({
        type: "hide-additions",
        hidden: shown ? hidden.filter((each) => each !== id) : [...hidden, id],
      }),
    }),
  );
  return [{ id: "additions", label: "Added objects", rank: 30, items }];
}

const NO_ADDITIONS = "No objects were added to this specimen.";

export const ADDITION_KEYS: readonly KeyGroup[] = [
  {
    name: "Added objects",
    rank: 75,
    keys: [
      key("F7", "Hide or show all objects that layers of the stage add", ({ state }) => {
        const { additions, hiddenAdditions } = state;
        if (additions.length === 0) return no(NO_ADDITIONS);
        return { type: "hide-additions", hidden: hiddenAdditions.length > 0 ? [] : additions };
      }),
    ],
  },
];
