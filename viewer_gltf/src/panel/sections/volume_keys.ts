/** The keys of where volumes show, and how finely. Pure. */
import { LIMITS } from "../../state/reduce";
import { type Key, key, neighbour } from "../key";
import { modesOf } from "../layout";

const QUALITIES = ["auto", "low", "high"] as const;
const DISC_STEP_DEG = 1;
/** Of a distance, so that near and far feel alike. */
const DISTANCE_FACTOR = 1.1;

function farther(factor: number): Key["to"] {
  const [least, most] = LIMITS.switchDistance_m;
  return ({ state: { switchDistance_m } }) => ({
    type: "set-switch-distance",
    distance_m: Math.min(most, Math.max(least, Number((switchDistance_m * factor).toPrecision(3)))),
  });
}

const wider =
  (by: number): Key["to"] =>
  ({ state }) => ({ type: "set-disc-radius", radius_deg: state.discRadius_deg + by });

export const VOLUME_KEYS: readonly Key[] = [
  key("m", "Next mode: where volumes show", ({ state }) => {
    const mode = neighbour(modesOf(state), state.mode, 1);
    return mode === null ? null : { type: "choose-mode", mode };
  }),
  key("s", "Smaller switch distance", farther(1 / DISTANCE_FACTOR)),
  key("S", "Larger switch distance", farther(DISTANCE_FACTOR)),
  key("d", "Smaller disc", wider(-DISC_STEP_DEG)),
  key("D", "Larger disc", wider(DISC_STEP_DEG)),
  key("q", "Next quality", ({ state }) => {
    const level = neighbour(QUALITIES, state.quality, 1);
    return level === null ? null : { type: "choose-quality", level };
  }),
];
