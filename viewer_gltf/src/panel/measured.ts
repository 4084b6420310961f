/** The measurement in progress, in words. Pure. */
import { measurementText } from "../probe/measure";
import { missing } from "../state/measurements";
import type { ViewerState } from "../state/viewer_state";

/** Returns the value, for example `12.3 µm`, or what the user has to do next. */
export function measuredText({ tool, measured, measuredAs, measureKind }: ViewerState): string {
  if (measured.length > 0) {
    const more = missing(measuredAs, measured);
    if (more === 0) return measurementText(measuredAs, measured);
    return more === 1 ? "Now choose the other point." : "Now choose the next point.";
  }
  if (tool !== "measure") return "";
  if (measureKind === "angle") return "Choose three points; the angle is measured at the second.";
  if (measureKind === "line") return "Choose points along the line, then Done.";
  return "Choose two points of the specimen.";
}
