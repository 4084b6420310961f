/**
 * How long one target (a tile or a control) has been gazed at. Plain data, so that tests need no
 * headset.
 *
 * A dwell fires once and is spent. It is spent as well when the layout under a resting gaze changes:
 * the user did not look for a control that slides or opens under the gaze. A spent dwell fires nothing
 * until the gaze moves on. The tremble of a resting head is no such move.
 *
 * A gaze that wanders over a large target, as over a tile or a long row, does not rest: its time begins again.
 */
import { dot, type Vec3 } from "../math/vec3";

/** The target that a ray meets in one frame, and its place. */
export type RaySample = Readonly<{
  /** The key of the target; null: nothing that can be chosen. */
  target: string | null;
  /** Where the target lies in its layout; null: it belongs to no layout. */
  place: string | null;
  /** The layout that the target belongs to: another text whenever a part of it comes, goes or moves. */
  layout: string;
  /** All layouts, among them that of the target. */
  layouts: readonly string[];
  /** Direction of the ray, of unit length. */
  direction: Vec3;
  /** Each point of the target chooses another value, as on a slider. */
  isGradual: boolean;
}>;

/** Where the gaze was when its dwell was spent. */
type Spent = Readonly<{
  direction: Vec3;
  target: string | null;
  /** Whether the target itself has fired. */
  hasFired: boolean;
}>;

export type Dwell = Readonly<{
  /** The sample of the previous frame; null: there was none. */
  sample: RaySample | null;
  elapsed_s: number;
  /** Direction of the gaze when its time last began; null: the dwell is spent, or nothing was seen yet. */
  began: Vec3 | null;
  /** null: the time counts. */
  spent: Spent | null;
}>;

export const DWELL_S = 1.5;
/** Time after which the ring shows, s: a gaze that passes by starts no ring. */
export const RING_S = 0.4;
/** Longest time that a frame counts, s: a stall of the page is no gaze. */
const LONGEST_FRAME_S = 0.1;
/** Largest turn of a resting head, radians, from one of its directions to another. */
export const TREMBLE_RAD = (1 * Math.PI) / 180;
/** Largest turn of a gaze that rests, radians, from where its rest began: the height of a large button. */
const REST_RAD = (5 * Math.PI) / 180;
/** Turn that is a move of its own, also within one control, radians. */
const MOVE_RAD = (1.5 * Math.PI) / 180;

export const NO_DWELL: Dwell = { sample: null, elapsed_s: 0, began: null, spent: null };

/** The next state, and whether this frame is the one on which the dwell fires. */
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

/** The dwell after the gaze or a button has chosen: the gaze chooses nothing more until it moves on. */
export function spend(dwell: Dwell): Dwell {
  const { sample } = dwell;
  if (sample === null) return dwell;
  const { direction, target } = sample;
  return { sample, elapsed_s: 0, began: null, spent: { direction, target, hasFired: true } };
}

/** Share of the ring that is filled, 0..1; 0 before the ring shows, and while the dwell is spent. */
export function dwellProgress({ elapsed_s }: Dwell): number {
  return Math.min(1, Math.max(0, (elapsed_s - RING_S) / (DWELL_S - RING_S)));
}

/** The angle between two directions of unit length, radians. */
export function angleBetween(a: Vec3, b: Vec3): number {
  return Math.acos(Math.min(1, Math.max(-1, dot(a, b))));
}

/**
 * Whether another target is under the gaze because its layout, or that of the target before, has changed, and
 * not because the gaze has moved. At the first sample this is so for each target of a layout.
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
