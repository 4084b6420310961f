/** The panel's section of the slice planes. Pure. */

import { controlsOf } from "../panel/control_templates";
import type { Control, PartSection } from "../panel/controls";
import { hasVolumes, type ViewerState } from "../state/viewer_state";
import { SLICES } from "./settings";

/** Back to the middle, along the axes. */
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
      label: "Back to the middle, not turned",
      to: () => STRAIGHT,
    },
    {
      kind: "text",
      id: "slice-values",
      label: "Where they meet",
      value: values.join(" · ") || "–",
    },
  ];
}

/**
 * @param values the channels' values where the slices meet
 * @param isFirst whether the slices come first in the panel, as for a patient on a flat screen
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
