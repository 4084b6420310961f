/** The panel's part for the path-traced picture: its light, its medium, and what comes after. Pure. */
import { setTo } from "../../state/parameters/kinds";
import {
  AFTER,
  LAMP,
  LAMPS_SHOWN,
  type LampParameters,
  MEDIUM,
  ROOM,
} from "../../state/parameters/light";
import { isTraced, MODE } from "../../state/parameters/volumes";
import type { ViewerState } from "../../state/viewer_state";
import { command, controlOf, controlsOf, paletteOf } from "../control_templates";
import type { Group, PanelView, Section } from "../controls";

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

/** @param isStereo then no file can be chosen */
export function lightItems(
  state: ViewerState,
  view: PanelView,
  isStereo: boolean,
): Section["items"] {
  if (!isTraced(state)) {
    return [
      {
        kind: "button",
        id: "trace",
        label: "Path tracing",
        to: () => setTo(MODE, "traced"),
      },
    ];
  }
  return [
    ...controlsOf(MEDIUM, state),
    ...(isStereo ? [] : [command("own-light", "Light of a .hdr or .exr file")]),
    ...controlsOf(ROOM, state),
    controlOf(LAMPS_SHOWN, state),
    ...LAMP.map((lamp) => lampGroup(lamp, state, view)),
    ...controlsOf(AFTER, state),
  ];
}
