/**
 * Finds the target that a ray of the gaze or of a hand hits, and chooses by button or by dwell.
 * Metres of the scene.
 */
import { type Matrix4, Vector3 } from "three";
import type { Command } from "../state/commands";
import { isSecondPress, type TimedPress } from "./double_press";
import { advanceDwell, type Dwell, dwellProgress, NO_DWELL, type RaySample, spend } from "./dwell";

/** `direction` has unit length. */
export type SceneRay = Readonly<{ origin: Vector3; direction: Vector3 }>;

export type Hit = Readonly<{
  /** Key of the hit, unique among all targets; null if it cannot be chosen. */
  key: string | null;
  distance_m: number;
  /**
   * Effect of holding the button: both kinds follow the ray until the button is released. Without
   * a button to hold, `carry` follows the ray from one choice to the next.
   */
  hold?: "slide" | "carry";
  /** Command that repeats in small steps while the button is held or the gaze stays. */
  repeats?: Command;
  /** Place of the hit in its target's layout; absent if it belongs to no layout. */
  place?: string;
  /** Whether each press advances by a step, so that quick presses all count. */
  isStep?: boolean;
  /** Whether a resting gaze chooses nothing here, because it opens by itself under the gaze. */
  isGlance?: boolean;
  /** Whether each point chooses another value, as on a slider. */
  isGradual?: boolean;
}>;

/** Something that rays can hit: the panel, handles, the specimen's tiles. */
export interface Target {
  /** Whether the target is drawn over nearer targets, so that rays hit it before them. */
  readonly isOnTop: boolean;
  /**
   * A text that changes when a control of the target appears, disappears or moves; absent if it has
   * none.
   */
  readonly layout?: string;
  /** Returns where the ray hits the target, or null. */
  intersect(ray: SceneRay): Hit | null;
  /**
   * Called when a hit is chosen by dwell (`isByGaze`) or button; a hit with `hold` is chosen before
   * it is dragged.
   */
  choose(hit: Hit, ray: SceneRay, isByGaze: boolean): void;
  /**
   * Called in each frame while a hit with `hold` follows the ray; `key` is that of the chosen hit.
   */
  drag?(key: string, ray: SceneRay): void;
}

export type TargetHit = Hit & Readonly<{ target: Target; ray: SceneRay }>;

/** The ray from the eyes straight ahead of the head. */
export function gazeOf(head: Matrix4): SceneRay {
  return {
    origin: new Vector3().setFromMatrixPosition(head),
    direction: new Vector3(0, 0, -1).transformDirection(head),
  };
}

/** The hit of the first target that is drawn on top, or else the nearest hit. */
export function firstHit(ray: SceneRay, targets: readonly Target[]): TargetHit | null {
  let first: TargetHit | null = null;
  for (const target of targets) {
    if (first?.target.isOnTop) break;
    const hit = target.intersect(ray);
    if (hit === null || !(hit.distance_m < (first?.distance_m ?? Infinity) || target.isOnTop)) {
      continue;
    }
    first = { ...hit, target, ray };
  }
  return first;
}

/** @param hit null: nothing can be chosen */
function sampleOf(
  { direction }: SceneRay,
  hit: TargetHit | null,
  targets: readonly Target[],
): RaySample {
  return {
    target: hit?.isGlance ? null : (hit?.key ?? null),
    place: hit?.place ?? null,
    layout: hit?.target.layout ?? "",
    layouts: ["", ...targets.map(({ layout = "" }) => layout)],
    direction: direction.toArray(),
    isGradual: hit?.isGradual === true || hit?.hold === "slide",
  };
}

export class Pointer {
  gaze: TargetHit | null = null;
  /** The hit of each hand's ray, in the order given. */
  hands: readonly (TargetHit | null)[] = [];
  private dwell: Dwell = NO_DWELL;
  private lastPress: TimedPress | null = null;

  /** Progress of the dwell, 0 to 1. */
  get progress(): number {
    return dwellProgress(this.dwell);
  }

  /** The hit at which the ring is drawn: that of a hand, or else that of the gaze. */
  get leading(): TargetHit | null {
    return this.hands.find((hit) => hit !== null) ?? this.gaze;
  }

  /**
   * Advances by one frame.
   * @returns the hit that the dwell chooses in this frame; the gaze chooses nothing while a hand
   *   points
   */
  advance(
    gaze: SceneRay,
    hands: readonly (SceneRay | null)[],
    targets: readonly Target[],
    dt_s: number,
    isDwellOn: boolean,
  ): TargetHit | null {
    this.gaze = firstHit(gaze, targets);
    this.hands = hands.map((ray) => ray && firstHit(ray, targets));
    const isGazing = this.hands.every((hit) => hit === null);
    const sample = sampleOf(gaze, isGazing ? this.gaze : null, targets);
    const [dwell, fires] = advanceDwell(this.dwell, sample, dt_s, isDwellOn);
    this.dwell = dwell;
    return fires ? this.gaze : null;
  }

  /**
   * Chooses a hit by a button or by the dwell. A resting gaze then chooses nothing else.
   *
   * @returns whether the press counts; the second press of a double press does not
   */
  press(hit: TargetHit, targets: readonly Target[], time_ms: number): boolean {
    this.dwell = spend(this.dwell);
    const sample = sampleOf(hit.ray, hit, targets);
    // The second press on a tile isolates it, and a slider may be picked up again at once.
    const isStep = hit.isStep === true || hit.hold !== undefined;
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

export function pointOn({ ray, distance_m }: Pick<TargetHit, "ray" | "distance_m">): Vector3 {
  return ray.direction.clone().multiplyScalar(distance_m).add(ray.origin);
}
