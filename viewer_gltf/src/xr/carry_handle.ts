/**
 * A handle that the gaze carries, where there is no button to hold: chosen once it follows the
 * gaze, and the next choice puts it down, by button or by letting the gaze rest.
 */
import type { Hit, Met, RoomRay, Target } from "../interaction/ray_pointer";

/** A gaze that stays within this angle of its first direction rests, radians. */
const REST_RAD = (1.5 * Math.PI) / 180;

export class GazeCarry implements Target {
  /** While it is carried, nothing else is met. */
  readonly isOnTop = true;
  readonly layout = "carry";
  private carried: Met | null = null;
  /** Where the gaze has come to rest, and how often it has gone on. */
  private rest: RoomRay | null = null;
  private rests = 0;

  get isCarrying(): boolean {
    return this.carried !== null;
  }

  /** The name of what is carried; null: nothing is. */
  get key(): string | null {
    return this.carried?.key ?? null;
  }

  take(met: Met): void {
    this.carried = met;
    this.rest = null;
  }

  drop(): void {
    this.carried = null;
  }

  /** It is as far away as it was when it was taken. */
  meet(): Hit | null {
    if (this.carried === null) return null;
    return { key: `carry:${this.rests}`, distance_m: this.carried.distance_m };
  }

  choose(): void {
    this.drop();
  }

  /** True if the handle was dragged. */
  follow(gaze: RoomRay): boolean {
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
