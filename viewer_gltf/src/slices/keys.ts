/** The keys of the slices. One key chooses a setting, and two keys decrease and increase it. Pure. */

import { type Key, type KeyGroup, key, keysOf, neighbour, no, refusalOf } from "../panel/key";
import { setTo, shareOf, valueAtShare } from "../state/parameters/kinds";
import { STRAIGHT } from "./section";
import { isSliced, NO_SLICES, SLICE_NUMBERS, SLICES } from "./settings";

/** Number of the slider's steps for each press of a key. */
const STEPS = 2;

function changeBy(steps: number): Key["to"] {
  return ({ state, view }) => {
    const row = SLICE_NUMBERS.find(({ id }) => id === view.parameter) ?? SLICE_NUMBERS[0];
    const at = shareOf(row, row.get(state)) + steps / row.steps;
    const refused = refusalOf(row, state);
    if (refused !== null) return refused;
    return setTo(row, valueAtShare(row, Math.min(1, Math.max(0, at))));
  };
}

const KEYS: readonly Key[] = [
  ...SLICES.flatMap(keysOf),
  key("^", "Choose the next setting of the slices: position or rotation", ({ view }) => {
    const ids = SLICE_NUMBERS.map(({ id }) => id);
    const parameter = neighbour(ids, view.parameter ?? undefined, 1);
    return parameter === null ? no("There is no setting.") : { panel: "parameter", parameter };
  }),
  key("{", "Decrease the chosen setting of the slices", changeBy(-STEPS)),
  key("}", "Increase the chosen setting of the slices", changeBy(STEPS)),
  key("~", "Centre and straighten the slices", ({ state }) =>
    isSliced(state) ? STRAIGHT : no(NO_SLICES),
  ),
];

export const SLICE_KEYS: readonly KeyGroup[] = [
  { name: "Slices", rank: 50, keys: KEYS, needsVolumes: true },
];
