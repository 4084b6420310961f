/** The panel's section of the slice planes. Pure. */
import { SLICES } from "../../state/parameters/slices";
import type { ViewerState } from "../../state/viewer_state";
import { controlsOf } from "../control_templates";
import type { Control } from "../controls";

/** Back to the middle, along the axes. */
export const STRAIGHT = {
  type: "move-slices",
  at: [0.5, 0.5, 0.5],
  turn_deg: [0, 0, 0],
} as const;

export function sliceItems(state: ViewerState, values: readonly string[]): readonly Control[] {
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
