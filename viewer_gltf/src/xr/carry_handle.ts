/**
 * A handle that the gaze carries, for devices without a button to hold. Once chosen, the handle
 * follows the gaze. The next choice puts it down, by a button or by a resting gaze.
 */
import type { Hit, SceneRay, Target, TargetHit } from "../interaction/ray_pointer";

/** Radians. A gaze that stays within this angle of its first direction is resting. */
const REST_RAD = (1.5 * Math.PI) / 180;

export class GazeCarry implements Target {
  /** While a handle is carried, no other target can be hit. */
  readonly isOnTop = true;
  readonly layout = "carry";
  private carried: TargetHit | null = null;
  /** The gaze since which the head has rested, and the number of such rests so far. */
  private rest: SceneRay | null = null;
  private rests = 0;

  get isCarrying(): boolean {
    return this.carried !== null;
  }

  /** The key of the carried handle, or null. */
  get key(): string | null {
    return this.carried?.key ?? null;
  }

  take(hit: TargetHit): void {
    this.carried = hit;
    this.rest = null;
  }

  drop(): void {
    this.carried = null;
  }

  /** The carried handle, at the distance at which it was picked up. */
  intersect(): Hit | null {
    if (this.carried === null) return null;
    return { key: `carry:${this.rests}`, distance_m: this.carried.distance_m };
  }

  choose(): void {
    this.drop();
  }

  /** Drags the carried handle along the gaze. Returns whether a handle was dragged. */
  follow(gaze: SceneRay): boolean {
    const { carried, rest } = this;
    if (carried?.key == null) return false;
    if (rest === null || rest.direction.angleTo(gaze.direction) > REST_RAD) {
      this.rest = gaze;
      this.rests++;
    }
    carried.target.drag?.(carried.key, gaze);
    return true;
  }
}
