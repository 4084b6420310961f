/** The keys of the slice planes: one chooses a number of them, two turn it. Pure. */

import { type Key, type KeyGroup, key, keysOf, neighbour, no, refusalOf } from "../panel/key";
import { setTo, shareOf, valueAtShare } from "../state/parameters/kinds";
import { STRAIGHT } from "./section";
import { isSliced, NO_SLICES, SLICE_NUMBERS, SLICES } from "./settings";

/** Steps of a number's slider by one press. */
const STEPS = 2;

function turn(steps: number): Key["to"] {
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
  key("^", "Next setting of the slices: where they meet, how they are turned", ({ view }) => {
    const ids = SLICE_NUMBERS.map(({ id }) => id);
    const parameter = neighbour(ids, view.parameter ?? undefined, 1);
    return parameter === null ? no("There is no number.") : { panel: "parameter", parameter };
  }),
  key("{", "Less of that setting", turn(-STEPS)),
  key("}", "More of that setting", turn(STEPS)),
  key("~", "Slices back to the middle, not turned", ({ state }) =>
    isSliced(state) ? STRAIGHT : no(NO_SLICES),
  ),
];

export const SLICE_KEYS: readonly KeyGroup[] = [
  { name: "Slices", rank: 50, keys: KEYS, needsVolumes: true },
];
