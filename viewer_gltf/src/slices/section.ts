/** The panel's section of the slices. Pure. */

import { controlsOf } from "../panel/control_templates";
import type { Control, PartSection } from "../panel/controls";
import { hasVolumes, type ViewerState } from "../state/viewer_state";
import { SLICES } from "./settings";

/** The action that centres the slices in the specimen and aligns them with its axes. */
export const STRAIGHT = {
  type: "move-slices",
  at: [0.5, 0.5, 0.5],
  turn_deg: [0, 0, 0],
} as const;

function sliceItems(state: ViewerState, values: readonly string[]): readonly Control[] {
  return [
    ...controlsOf(SLICES, state),
    {
      kind: "button",
      id: "straight-slices",
      label: "Centre and straighten the slices",
      to: () => STRAIGHT,
    },
    {
      kind: "text",
      id: "slice-values",
      label: "Values where the slices meet",
      value: values.join(" · ") || "–",
    },
  ];
}

/**
 * @param values the channels' values where the slices meet
 * @param isFirst whether the slices are the first section of the panel
 */
export function sliceSections(
  state: ViewerState,
  values: readonly string[],
  isFirst: boolean,
): readonly PartSection[] {
  if (!hasVolumes(state)) return [];
  const rank = isFirst ? 5 : 60;
  return [{ id: "slices", label: "Slices", rank, items: sliceItems(state, values) }];
}
