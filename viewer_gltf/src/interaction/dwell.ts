/**
 * How long one target (a tile or a control) has been gazed at. Plain data, so that tests need no
 * headset. Dwell fires late what the button fires at once; neither waits for the other.
 */
export type Dwell = Readonly<{
  target: string | null;
  elapsed_s: number;
  /** A target that has fired, by gaze or button, is done with until the gaze leaves it. */
  hasFired: boolean;
}>;

export const DWELL_S = 1.5;
/** Longest time that a frame counts, s: a stall of the page is no gaze. */
const LONGEST_FRAME_S = 0.1;

export const NO_DWELL: Dwell = { target: null, elapsed_s: 0, hasFired: false };

/** The next state, and whether this frame is the one on which the dwell fires. */
export function advanceDwell(
  dwell: Dwell,
  target: string | null,
  dt_s: number,
  isOn = true,
): readonly [Dwell, boolean] {
  if (target !== dwell.target) return [{ target, elapsed_s: 0, hasFired: false }, false];
  if (target === null || dwell.hasFired) return [dwell, false];
  if (!isOn) return [dwell.elapsed_s === 0 ? dwell : { ...dwell, elapsed_s: 0 }, false];
  const elapsed_s = dwell.elapsed_s + Math.min(Math.max(dt_s, 0), LONGEST_FRAME_S);
  const fires = elapsed_s >= DWELL_S;
  return [{ target, elapsed_s, hasFired: fires }, fires];
}

/**
 * The button: fires whatever is gazed at, as often as it is pressed, also where dwell is off. The
 * dwell does not fire the same target a second time.
 */
export function fire(dwell: Dwell): readonly [Dwell, boolean] {
  if (dwell.target === null) return [dwell, false];
  return [{ ...dwell, hasFired: true }, true];
}

/** Share of the ring that is filled, 0..1; 0 after the target has fired: the ring is gone. */
export function dwellProgress(dwell: Dwell): number {
  if (dwell.target === null || dwell.hasFired) return 0;
  return Math.min(1, dwell.elapsed_s / DWELL_S);
}
