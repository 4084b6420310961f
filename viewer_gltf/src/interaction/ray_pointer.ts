/**
 * What a ray of the gaze or of a hand meets in the room, and what looking at it for long chooses.
 * Metres of the room.
 */
import { type Matrix4, Vector3 } from "three";
import type { Command } from "../state/commands";
import { isSecondPress, type TimedPress } from "./double_press";
import { advanceDwell, type Dwell, dwellProgress, NO_DWELL, type RaySample, spend } from "./dwell";

/** `direction` has unit length. */
export type RoomRay = Readonly<{ origin: Vector3; direction: Vector3 }>;

export type Hit = Readonly<{
  /** The name of the hit, unique among all targets; null: nothing that can be chosen. */
  key: string | null;
  distance_m: number;
  /**
   * What holding the button does: `slide` follows the ray as long as it is held; `carry` does so
   * too, and where there is no button to hold, from one choice to the next.
   */
  hold?: "slide" | "carry";
  /** Goes on, little by little, while the button is held or the gaze stays. */
  repeats?: Command;
  /** The hit's place in its target's layout; absent: it belongs to no layout. */
  place?: string;
  /** Each press moves on by a step, so quick presses all count. */
  isStep?: boolean;
  /** A gaze that rests on it chooses nothing: what it shows comes by itself. */
  isGlance?: boolean;
  /** Each point of it chooses something else, as on a slider. */
  isGradual?: boolean;
}>;

/** Something that rays meet: the panel, handles, the specimen's tiles. */
export interface Target {
  /** Drawn over what is nearer, so that it is met before it. */
  readonly isOnTop: boolean;
  /** Changes whenever a control of the target appears, disappears or moves; absent: it has none. */
  readonly layout?: string;
  meet(ray: RoomRay): Hit | null;
  /** Chosen by dwell (`isByGaze`) or button; what holds on to the ray is chosen before it is dragged. */
  choose(hit: Hit, ray: RoomRay, isByGaze: boolean): void;
  /** What holds on to the ray follows it, frame by frame; `key` is the hit's that was chosen. */
  drag?(key: string, ray: RoomRay): void;
}

export type Met = Hit & Readonly<{ target: Target; ray: RoomRay }>;

/** Straight ahead of the head. */
export function gazeOf(head: Matrix4): RoomRay {
  return {
    origin: new Vector3().setFromMatrixPosition(head),
    direction: new Vector3(0, 0, -1).transformDirection(head),
  };
}

/** The nearest of the targets; of those on top, the first. */
export function meetFirst(ray: RoomRay, targets: readonly Target[]): Met | null {
  let first: Met | null = null;
  for (const target of targets) {
    if (first?.target.isOnTop) break;
    const hit = target.meet(ray);
    if (hit === null || !(hit.distance_m < (first?.distance_m ?? Infinity) || target.isOnTop)) {
      continue;
    }
    first = { ...hit, target, ray };
  }
  return first;
}

/** @param met null: nothing can be chosen */
function sampleOf({ direction }: RoomRay, met: Met | null, targets: readonly Target[]): RaySample {
  return {
    target: met?.isGlance ? null : (met?.key ?? null),
    place: met?.place ?? null,
    layout: met?.target.layout ?? "",
    layouts: ["", ...targets.map(({ layout = "" }) => layout)],
    direction: direction.toArray(),
    isGradual: met?.isGradual === true || met?.hold === "slide",
  };
}

export class Pointer {
  /** The hit of the gaze. */
  gaze: Met | null = null;
  /** The hit of each hand's ray, in the order given. */
  hands: readonly (Met | null)[] = [];
  private dwell: Dwell = NO_DWELL;
  private lastPress: TimedPress | null = null;

  /** Of the dwell, 0..1. */
  get progress(): number {
    return dwellProgress(this.dwell);
  }

  /** Where the ring is: at what a hand points at; if none does, at what is gazed at. */
  get leading(): Met | null {
    return this.hands.find((met) => met !== null) ?? this.gaze;
  }

  /** @returns what the dwell chooses in this frame; the gaze chooses nothing while a hand points */
  advance(
    gaze: RoomRay,
    hands: readonly (RoomRay | null)[],
    targets: readonly Target[],
    dt_s: number,
    isDwellOn: boolean,
  ): Met | null {
    this.gaze = meetFirst(gaze, targets);
    this.hands = hands.map((ray) => ray && meetFirst(ray, targets));
    const isGazing = this.hands.every((met) => met === null);
    const sample = sampleOf(gaze, isGazing ? this.gaze : null, targets);
    const [dwell, fires] = advanceDwell(this.dwell, sample, dt_s, isDwellOn);
    this.dwell = dwell;
    return fires ? this.gaze : null;
  }

  /**
   * Choose a hit, by a button or by the dwell. A gaze that stays chooses nothing more.
   *
   * @returns whether the press counts; the second press of a double press does not
   */
  press(met: Met, targets: readonly Target[], time_ms: number): boolean {
    this.dwell = spend(this.dwell);
    const sample = sampleOf(met.ray, met, targets);
    // The second press on a tile isolates it, and a slider may be taken again, however soon.
    const isStep = met.isStep === true || met.hold !== undefined;
    const press = { time_ms, sample, isStep };
    const isSecond = isSecondPress(this.lastPress, press);
    this.lastPress = press;
    return !isSecond;
  }

  reset(): void {
    this.gaze = null;
    this.hands = [];
    this.dwell = NO_DWELL;
    this.lastPress = null;
  }
}

/** The place where a ray meets a target. */
export function pointOn({ ray, distance_m }: Pick<Met, "ray" | "distance_m">): Vector3 {
  return ray.direction.clone().multiplyScalar(distance_m).add(ray.origin);
}
