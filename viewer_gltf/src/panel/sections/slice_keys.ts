/** The keys of the slice planes: one chooses a number of them, two turn it. Pure. */
import { setTo, shareOf, valueAtShare } from "../../state/parameters/kinds";
import { SLICE_NUMBERS, SLICE_PICTURES, SLICE_PLANES } from "../../state/parameters/slices";
import { type Key, key, keysOf, neighbour } from "../key";
import { STRAIGHT } from "./slices";

/** Steps of a number's slider by one press. */
const STEPS = 2;

function turn(steps: number): Key["to"] {
  return ({ state, view }) => {
    const row = SLICE_NUMBERS.find(({ id }) => id === view.parameter) ?? SLICE_NUMBERS[0];
    const at = shareOf(row, row.get(state)) + steps / row.steps;
    return setTo(row, valueAtShare(row, Math.min(1, Math.max(0, at))));
  };
}

export const SLICE_KEYS: readonly Key[] = [
  ...keysOf(SLICE_PICTURES),
  ...keysOf(SLICE_PLANES),
  key("^", "Next number of the slices: where they meet, how they are turned", ({ view }) => {
    const ids = SLICE_NUMBERS.map(({ id }) => id);
    const parameter = neighbour(ids, view.parameter ?? undefined, 1);
    return parameter === null ? null : { panel: "parameter", parameter };
  }),
  key("{", "Less of it", turn(-STEPS)),
  key("}", "More of it", turn(STEPS)),
  key("~", "Slices to the middle, straight", STRAIGHT),
];
