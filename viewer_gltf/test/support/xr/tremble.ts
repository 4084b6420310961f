/** The tremble of a resting head: a slow sway and a quick tremor, at most 0.45 degrees off. */
import { seeded } from "../seeded";

/** Sway of a resting head, degrees to either side, and its period, s. */
const SWAY_DEG = 0.3;
const SWAY_S = 2.3;
/** Tremor of a resting head, degrees to either side. */
const TREMOR_DEG = 0.15;

/** Offsets of a head from the direction in which it looks, frame by frame, degrees to the right and up. */
export function* tremble(frame_s: number): Generator<readonly [right_deg: number, up_deg: number]> {
  const random = seeded(7);
  const tremor = () => TREMOR_DEG * (2 * random() - 1);
  for (let k = 0; ; k++) {
    const sway = SWAY_DEG * Math.sin((2 * Math.PI * k * frame_s) / SWAY_S);
    yield [sway / 2 + tremor(), sway + tremor()];
  }
}
