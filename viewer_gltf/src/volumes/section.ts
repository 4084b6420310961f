/** The panel's sections of volumes: where they are shown, and how. */
import { controlOf, controlsOf } from "../panel/control_templates";
import type { Control, PartSection } from "../panel/controls";
import { DISC_RADIUS, MODE, VOLUMES } from "../state/parameters/volumes";
import { hasVolumes, type ViewerState } from "../state/viewer_state";

/**
 * @param discLimit_deg radius, degrees, to which the largest number of tiles reduces the focus
 * disc; null if it does not reduce it
 */
export function volumeSections(
  state: ViewerState,
  discLimit_deg: number | null,
): readonly PartSection[] {
  if (!hasVolumes(state)) return [];
  const others = VOLUMES.filter((row) => row !== MODE);
  const items = controlsOf(others, state).map((item) => discItem(item, state, discLimit_deg));
  return [
    { rank: 30, id: "volumes", label: "Surfaces and volumes", items: [controlOf(MODE, state)] },
    { rank: 40, id: "volume-settings", label: "Volume settings", isDeeper: true, items },
  ];
}

/** The focus disc's slider; if the limit of tiles reduces the radius, with the current radius. */
function discItem(item: Control, { mode }: ViewerState, discLimit_deg: number | null): Control {
  const isCut = item.id === DISC_RADIUS.id && mode === "disc" && discLimit_deg !== null;
  if (!isCut || item.kind !== "slider") return item;
  return { ...item, text: `${item.text}, now ${discLimit_deg.toFixed(0)}°` };
}
