/** The panel's section for path tracing: the medium, the light, and the adjustments of the finished frame. Pure. */

import { command, controlOf, controlsOf, paletteOf } from "../panel/control_templates";
import type { Button, Group, PanelView, PartSection, Section } from "../panel/controls";
import { setTo } from "../state/parameters/kinds";
import {
  AFTER,
  ENVIRONMENT_ROWS,
  LAMP,
  LAMPS_SHOWN,
  type LampParameters,
  MEDIUM,
  TRACED_ALONE,
} from "../state/parameters/light";
import { isTraced, MODE } from "../state/parameters/volumes";
import { REFUSED } from "../state/refusals";
import { hasVolumes, type ViewerState } from "../state/viewer_state";

function lampGroup(lamp: LampParameters, state: ViewerState, { picked }: PanelView): Group {
  const { id, name, color, isOn, numbers } = lamp;
  const isOpen = picked === id;
  return {
    kind: "group",
    id,
    label: name,
    tags: [],
    about: "",
    isDimmed: false,
    isOpen,
    opener: { panel: "pick", channel: isOpen ? null : id },
    controls: [controlOf(color, state), controlOf(isOn, state)],
    more: [...controlsOf(numbers, state), paletteOf(color, state, `${id}/palette`)],
  };
}

/**
 * Returns the controls of path tracing. On a flat screen the rows are always the same, so that none moves when path
 * tracing begins. In stereo the settings appear only during path tracing, and no file can be chosen.
 */
export function lightItems(
  state: ViewerState,
  view: PanelView,
  isStereo: boolean,
): Section["items"] {
  const isOn = isTraced(state);
  const begin: Button = {
    kind: "button",
    id: "trace",
    label: "Path tracing",
    refusal: isOn ? REFUSED.tracing : "",
    to: () => setTo(MODE, "traced"),
  };
  if (isStereo) return isOn ? settingsOf(state, view) : [begin];
  const ownLight: Button = {
    ...command("own-light", "Light from a .hdr or .exr file"),
    refusal: isOn ? "" : TRACED_ALONE,
  };
  return [begin, ...settingsOf(state, view, ownLight)];
}

function settingsOf(
  state: ViewerState,
  view: PanelView,
  ...ownLight: readonly Button[]
): Section["items"] {
  return [
    ...controlsOf(MEDIUM, state),
    ...ownLight,
    ...controlsOf(ENVIRONMENT_ROWS, state),
    controlOf(LAMPS_SHOWN, state),
    ...LAMP.map((lamp) => lampGroup(lamp, state, view)),
    ...controlsOf(AFTER, state),
  ];
}

export function lightSections(
  state: ViewerState,
  view: PanelView,
  isStereo: boolean,
): readonly PartSection[] {
  if (!hasVolumes(state)) return [];
  const items = lightItems(state, view, isStereo);
  return [{ rank: 50, id: "light", label: "Path tracing", isDeeper: true, items }];
}
