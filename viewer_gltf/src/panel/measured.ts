/** The newest measurement in words. Pure. */
import { measurementText } from "../probe/measure";
import { missing } from "../state/measurements";
import type { ViewerState } from "../state/viewer_state";

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
