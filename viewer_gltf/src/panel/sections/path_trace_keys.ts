/** The keys of the path-traced picture. Pure. */
import { DIALS, shareOf, valueAtShare } from "../../state/path_trace_parameters";
import { isTraced } from "../../state/viewer_state";
import { type Key, key, neighbour } from "../key";

function nextDial(by: number): Key["to"] {
  return ({ view }) => {
    const ids = DIALS.map(({ id }) => id);
    const dial = neighbour(ids, view.dial ?? undefined, by);
    return dial === null ? null : { panel: "dial", dial };
  };
}

function turn(steps: number): Key["to"] {
  return ({ state: { trace }, view }) => {
    const dial = DIALS.find(({ id }) => id === view.dial) ?? DIALS[0];
    const at = shareOf(dial, dial.of(trace)) + (2 * steps) / dial.steps;
    return dial.to(valueAtShare(dial, Math.min(1, Math.max(0, at))));
  };
}

export const LIGHT_KEYS: readonly Key[] = [
  key("G", "Paths of light on or off", ({ state }) => ({
    type: "choose-mode",
    mode: isTraced(state) ? "all" : "traced",
  })),
  key("F", "Next number of the light: the two keys below mean it", nextDial(1)),
  key("X", "The number before", nextDial(-1)),
  key("[", "Less of it", turn(-1)),
  key("]", "More of it", turn(1)),
  key("M", "Scattered once or many times", ({ state: { trace } }) => ({
    type: "trace",
    change: { isMultiple: !trace.isMultiple },
  })),
  key("I", "Next room", ({ state: { trace } }) => ({
    type: "trace",
    change: { environment: trace.environment === "studio" ? "sky" : "studio" },
  })),
  key("U", "Light of a .hdr or .exr file", "own-light"),
  key(["!", "@", "#"], "Lamp 1, 2 or 3 on or off", ({ state: { trace } }, name) => {
    const lamp = ["!", "@", "#"].indexOf(name);
    return { type: "move-lamp", lamp, change: { isOn: !trace.lamps[lamp].isOn } };
  }),
  key("$", "Show or hide the lamps, to be dragged", ({ state }) =>
    isTraced(state) ? { type: "show-lamps", areShown: !state.areLampsShown } : null,
  ),
  key("Z", "Before or after what comes after the light", ({ state: { trace } }) => ({
    type: "trace",
    change: { isPostOn: !trace.isPostOn },
  })),
];
