/** The panel's part for the path-traced picture: its light, its medium, and what comes after. Pure. */
import { fromHex, toHex } from "../../math/color";
import {
  type Dial,
  lampDials,
  MEDIUM_DIALS,
  POST_DIALS,
  ROOM_DIALS,
  shareOf,
  valueAtShare,
} from "../../state/path_trace_parameters";
import {
  ENVIRONMENTS,
  type EnvironmentName,
  TONE_MAPS,
  type TraceSettings,
} from "../../state/path_trace_settings";
import { isTraced, type ViewerState } from "../../state/viewer_state";
import { command, inline } from "../control_templates";
import type { Control, Group, PanelView, Section } from "../controls";
import { PALETTES } from "../palettes";

const ROOM_NAMES: Readonly<Record<EnvironmentName, string>> = {
  studio: "Studio",
  sky: "Sky",
  own: "Own",
};
const TONE_NAMES = { filmic: "Film", none: "None" } as const;

function slider(dial: Dial, trace: TraceSettings): Control {
  const value = dial.of(trace);
  return {
    kind: "slider",
    id: `trace/${dial.id}`,
    label: dial.name,
    value: shareOf(dial, value),
    steps: dial.steps,
    text: dial.text(value),
    to: (share) => dial.to(valueAtShare(dial, share)),
  };
}

function lampGroup(lamp: number, { trace }: ViewerState, { picked }: PanelView): Group {
  const { isOn, color } = trace.lamps[lamp];
  const id = `lamp-${lamp}`;
  const name = `Lamp ${lamp + 1}`;
  const isOpen = picked === id;
  const recolor = (hex: string) =>
    ({ type: "move-lamp", lamp, change: { color: fromHex(hex) } }) as const;
  return {
    kind: "group",
    id,
    label: name,
    tags: [],
    isOpen,
    opener: { panel: "pick", channel: isOpen ? null : id },
    controls: [
      {
        kind: "colour",
        id: `${id}/color`,
        label: "Any colour",
        name: `Colour of ${name}`,
        value: toHex(color),
        palettes: [],
        to: recolor,
      },
      {
        kind: "toggle",
        id: `${id}/on`,
        label: "On",
        name: `${name} on`,
        value: isOn,
        to: (value) => ({ type: "move-lamp", lamp, change: { isOn: value } }),
      },
    ],
    more: [
      ...lampDials(lamp).map((dial) => slider(dial, trace)),
      {
        kind: "colour",
        id: `${id}/palette`,
        label: "Colour",
        name: `Colour of ${name}`,
        value: toHex(color),
        palettes: PALETTES,
        to: recolor,
      },
    ],
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
        label: "Trace paths of light",
        to: () => ({ type: "choose-mode", mode: "traced" }),
      },
    ];
  }
  const { trace } = state;
  const rooms = ENVIRONMENTS.filter((name) => name !== "own" || trace.environment === "own");
  return [
    ...MEDIUM_DIALS.map((dial) => slider(dial, trace)),
    {
      kind: "toggle",
      id: "trace/multiple",
      label: "Scattered many times",
      value: trace.isMultiple,
      to: (isMultiple) => ({ type: "trace", change: { isMultiple } }),
    },
    inline("trace-room", "Room", trace.environment, ROOM_NAMES, rooms, (environment) => ({
      type: "trace",
      change: { environment },
    })),
    ...(isStereo ? [] : [command("own-light", "Light of a .hdr or .exr file")]),
    ...ROOM_DIALS.map((dial) => slider(dial, trace)),
    {
      kind: "toggle",
      id: "trace/lamps",
      label: "Show lamps",
      name: "Show the lamps, to be dragged",
      value: state.areLampsShown,
      to: (areShown) => ({ type: "show-lamps", areShown }),
    },
    ...trace.lamps.map((_, lamp) => lampGroup(lamp, state, view)),
    ...postItems(trace),
  ];
}

/** What comes after the light. */
function postItems(trace: TraceSettings): Section["items"] {
  return [
    {
      kind: "toggle",
      id: "trace/post",
      label: "After (off: before)",
      name: "Show the picture after these changes",
      value: trace.isPostOn,
      to: (isPostOn) => ({ type: "trace", change: { isPostOn } }),
    },
    ...POST_DIALS.map((dial) => slider(dial, trace)),
    inline("trace-tone-map", "Tone map", trace.toneMap, TONE_NAMES, TONE_MAPS, (toneMap) => ({
      type: "trace",
      change: { toneMap },
    })),
  ];
}
