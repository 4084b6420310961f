/** The keys of path tracing. Pure. */

import { type Key, type KeyGroup, key, keysOf, neighbour, no, refusalOf } from "../panel/key";
import { type NumberParameter, setTo, shareOf, valueAtShare } from "../state/parameters/kinds";
import {
  AFTER,
  ENVIRONMENT_ROWS,
  LAMP,
  LAMPS_SHOWN,
  LIGHT_NUMBERS,
  MEDIUM,
  TRACED_ALONE,
} from "../state/parameters/light";
import { STEREO_NUMBERS } from "../state/parameters/tools";
import { isTraced, MODE } from "../state/parameters/volumes";
import type { ViewerState } from "../state/viewer_state";

/** The keys that switch the lamps. */
const LAMP_KEYS: readonly string[] = ["!", "@", "#"];

const NUMBERS: readonly NumberParameter<ViewerState>[] = [...LIGHT_NUMBERS, ...STEREO_NUMBERS];

function nextNumber(by: number): Key["to"] {
  return ({ view }) => {
    const ids = NUMBERS.map(({ id }) => id);
    const parameter = neighbour(ids, view.parameter ?? undefined, by);
    return parameter === null ? no("There is no setting.") : { panel: "parameter", parameter };
  };
}

function changeBy(steps: number): Key["to"] {
  return ({ state, view }) => {
    const row = NUMBERS.find(({ id }) => id === view.parameter) ?? NUMBERS[0];
    const at = shareOf(row, row.get(state)) + (2 * steps) / row.steps;
    const refused = refusalOf(row, state);
    if (refused !== null) return refused;
    return setTo(row, valueAtShare(row, Math.min(1, Math.max(0, at))));
  };
}

const KEYS: readonly Key[] = [
  key("G", "Path tracing on or off", ({ state }) =>
    setTo(MODE, isTraced(state) ? "all" : "traced"),
  ),
  key("F", "Choose the next setting of path tracing, then of stereo", nextNumber(1)),
  key("X", "Choose the previous setting of path tracing or stereo", nextNumber(-1)),
  key("[", "Decrease the chosen setting of path tracing or stereo", changeBy(-1)),
  key("]", "Increase the chosen setting of path tracing or stereo", changeBy(1)),
  ...[...MEDIUM, ...ENVIRONMENT_ROWS].flatMap(keysOf),
  key("U", "Light from a .hdr or .exr file", ({ state }) =>
    isTraced(state) ? "own-light" : no(TRACED_ALONE),
  ),
  key(LAMP_KEYS, "Lamp 1, 2 or 3 on or off", ({ state }, name) => {
    const { isOn } = LAMP[LAMP_KEYS.indexOf(name)];
    return refusalOf(isOn, state) ?? setTo(isOn, !isOn.get(state));
  }),
  ...keysOf(LAMPS_SHOWN),
  ...AFTER.flatMap(keysOf),
];

export const LIGHT_KEYS: readonly KeyGroup[] = [
  { name: "Path tracing", rank: 60, keys: KEYS, needsVolumes: true },
];
