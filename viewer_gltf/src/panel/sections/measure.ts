/** The panel's section of measuring: what a tap does, the newest measurement, and the list. Pure. */
import { measurementText } from "../../probe/measure";
import type { Action } from "../../state/actions";
import { type Measurement, missing } from "../../state/measurements";
import { MEASURE_PARAMETERS } from "../../state/parameters/tools";
import { REFUSED } from "../../state/refusals";
import type { ViewerState } from "../../state/viewer_state";
import { command, controlsOf } from "../control_templates";
import type { Control } from "../controls";

const POINT_NAMES = ["First point", "Second point", "Third point"] as const;
/** So many finished ones have a row; the file has all. */
const MAX_LISTED = 12;

/** `12.3 µm`, or what is missing to it. */
export function measuredText({ tool, measured, measuredAs, measureKind }: ViewerState): string {
  if (measured.length > 0) {
    const more = missing(measuredAs, measured);
    if (more === 0) return measurementText(measuredAs, measured);
    return more === 1 ? "Now choose the other point." : "Now choose the next point.";
  }
  if (tool !== "measure") return "";
  if (measureKind === "angle") return "Choose three points: the angle is at the second.";
  if (measureKind === "line") return "Choose points along the line, then Done.";
  return "Choose two points of the specimen.";
}

/** Of the newest one, then of the list; null: there is none. */
export function clearMeasured({ measured, measurements }: ViewerState): Action | null {
  if (measured.length > 0) return { type: "measure", points: [] };
  if (measurements.length === 0) return null;
  return { type: "set-measurements", measurements: measurements.slice(0, -1) };
}

export function measureItems(
  state: ViewerState,
  values: readonly (readonly string[])[],
): readonly Control[] {
  const { measured, measuredAs, measurements } = state;
  const isOpen = missing(measuredAs, measured) > 0;
  return [
    ...controlsOf(MEASURE_PARAMETERS, state),
    { kind: "text", id: "distance", label: "Measured", value: measuredText(state) },
    ...POINT_NAMES.slice(0, Math.max(2, measured.length)).map((label, i): Control => {
      const value = (values[i] ?? []).join(" · ");
      return { kind: "text", id: `values-${i}`, label, value };
    }),
    {
      kind: "button",
      id: "finish-measuring",
      label: "Done: keep the measurement",
      refusal: isOpen ? REFUSED.points : "",
      to: () => ({ type: "finish-measuring" }),
    },
    {
      kind: "button",
      id: "clear-measured",
      label: "Clear",
      name: "Clear the newest measurement",
      refusal: clearMeasured(state) === null ? REFUSED.measured : "",
      to: () => clearMeasured(state) ?? { type: "measure", points: [] },
    },
    ...measurements.slice(-MAX_LISTED).flatMap((each, i) => {
      const index = Math.max(0, measurements.length - MAX_LISTED) + i;
      return listed(each, index, measurements);
    }),
    {
      ...command("save-csv", "Save as CSV"),
      refusal: isOpen && measurements.length === 0 ? REFUSED.measured : "",
    },
  ];
}

function listed(
  { name, kind, points }: Measurement,
  index: number,
  all: readonly Measurement[],
): readonly Control[] {
  const change = (measurements: readonly Measurement[]): Action => ({
    type: "set-measurements",
    measurements,
  });
  return [
    { kind: "text", id: `measurement-${index}`, label: name, value: measurementText(kind, points) },
    {
      kind: "search",
      id: `measurement-${index}-name`,
      label: `Name of ${name}`,
      value: name,
      to: (text) => change(all.map((each, i) => (i === index ? { ...each, name: text } : each))),
    },
    {
      kind: "button",
      id: `measurement-${index}-remove`,
      label: `Remove ${name}`,
      to: () => change(all.filter((_, i) => i !== index)),
    },
  ];
}
