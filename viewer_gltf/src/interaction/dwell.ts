/**
 * How long a target (a tile or a control) has been gazed at, as plain data, so that tests need no
 * headset.
 *
 * A dwell fires once and is then spent. It is also spent when the layout under a resting gaze
 * changes, since the user did not look for a control that moves or opens under the gaze. A spent
 * dwell does not fire until the gaze moves on. The tremble of a resting head does not count as
 * moving on.
 *
 * A gaze that wanders over a large target, such as a tile or a long row, is not at rest, so its
 * time starts again.
 */
import { dot, type Vec3 } from "../math/vec3";

/** The target that a ray hits in one frame, and the target's position in its layout. */
export type RaySample = Readonly<{
  /** Key of the target; null if there is none that can be chosen. */
  target: string | null;
  /** Place of the target in its layout; null if it belongs to no layout. */
  place: string | null;
  /**
   * Layout of the target: a text that changes when a part of the layout appears, disappears or
   * moves.
   */
  layout: string;
  /** All layouts, including that of the target. */
  layouts: readonly string[];
  /** Unit direction of the ray. */
  direction: Vec3;
  /** Whether each point of the target chooses another value, as on a slider. */
  isGradual: boolean;
}>;

type Spent = Readonly<{
  direction: Vec3;
  target: string | null;
  hasFired: boolean;
}>;

export type Dwell = Readonly<{
  sample: RaySample | null;
  elapsed_s: number;
  /**
   * Direction of the gaze when its time last started; null if the dwell is spent or nothing was
   * seen yet.
   */
  began: Vec3 | null;
  /** State of a spent dwell, which does not fire; null while the time of the gaze counts. */
  spent: Spent | null;
}>;

/** Seconds that a gaze must rest until it chooses. */
export const DWELL_S = 1.5;
/** Seconds until the ring is shown, so that a passing gaze shows no ring. */
export const RING_S = 0.4;
/**
 * Seconds. Longest time that one frame counts, so that a stall of the page is not taken for a gaze.
 */
const LONGEST_FRAME_S = 0.1;
/** Radians. Largest angle between two directions of a resting head. */
export const TREMBLE_RAD = (1 * Math.PI) / 180;
/**
 * Radians. Largest angle of a resting gaze from where its rest began: the height of a large button.
 */
const REST_RAD = (5 * Math.PI) / 180;
/** Radians. A turn by this angle is intended, even within one control. */
const MOVE_RAD = (1.5 * Math.PI) / 180;

export const NO_DWELL: Dwell = { sample: null, elapsed_s: 0, began: null, spent: null };

/** Returns the next state, and whether the dwell fires in this frame. */
export function advanceDwell(
  dwell: Dwell,
  sample: RaySample,
  dt_s: number,
  isOn = true,
): readonly [Dwell, boolean] {
  const { spent } = dwell;
  if (hasLayoutChanged(dwell.sample, sample)) {
    const hasFired = spent?.hasFired === true && spent.target === sample.target;
    const direction = spent?.direction ?? sample.direction;
    const { target } = sample;
    const news = { direction, target, hasFired };
    return [{ sample, elapsed_s: 0, began: null, spent: news }, false];
  }
  if (spent !== null && !hasLeft(spent, sample)) {
    return [{ sample, elapsed_s: 0, began: null, spent }, false];
  }
  const isCounting = spent === null && isOn && sample.target === dwell.sample?.target;
  const began = dwell.began ?? sample.direction;
  const isResting = angleBetween(began, sample.direction) <= REST_RAD;
  if (!isCounting || sample.target === null || !isResting) {
    return [{ sample, elapsed_s: 0, began: sample.direction, spent: null }, false];
  }
  const elapsed_s = dwell.elapsed_s + Math.min(Math.max(dt_s, 0), LONGEST_FRAME_S);
  const next = { sample, elapsed_s, began, spent: null };
  return elapsed_s < DWELL_S ? [next, false] : [spend(next), true];
}

/**
 * The dwell after the gaze or a button has chosen: the gaze chooses nothing else until it moves on.
 */
export function spend(dwell: Dwell): Dwell {
  const { sample } = dwell;
  if (sample === null) return dwell;
  const { direction, target } = sample;
  return { sample, elapsed_s: 0, began: null, spent: { direction, target, hasFired: true } };
}

/**
 * Share of the ring that is filled, 0 to 1; 0 before the ring is shown and while the dwell is
 * spent.
 */
export function dwellProgress({ elapsed_s }: Dwell): number {
  return Math.min(1, Math.max(0, (elapsed_s - RING_S) / (DWELL_S - RING_S)));
}

/** The angle between two unit vectors, radians. */
export function angleBetween(a: Vec3, b: Vec3): number {
  return Math.acos(Math.min(1, Math.max(-1, dot(a, b))));
}

/**
 * Whether another target is under the gaze because a layout has changed, and not because the gaze
 * has moved. For the first sample this is true for each target in a layout.
 */
function hasLayoutChanged(before: RaySample | null, now: RaySample): boolean {
  if (before === null) return now.place !== null;
  if (now.layouts.includes(before.layout) && before.layouts.includes(now.layout)) return false;
  return before.target !== now.target || before.place !== now.place;
}

/** Whether the gaze has moved on since its dwell was spent. */
function hasLeft({ direction, target, hasFired }: Spent, sample: RaySample): boolean {
  const turn = angleBetween(direction, sample.direction);
  const isElsewhere = sample.target !== target;
  if (turn > MOVE_RAD) return isElsewhere || sample.isGradual || !hasFired;
  return turn > TREMBLE_RAD && isElsewhere;
}
