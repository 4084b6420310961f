/**
 * The moment before the last choice in stereo. The bar's *Undo* returns to it for a few seconds.
 */
import type { SpecimenPose } from "../math/grab";
import type { ViewerState } from "../state/viewer_state";

/** Seconds after a choice during which it can be undone. */
const UNDO_S = 4;

export type Moment = Readonly<{ state: ViewerState; pose: SpecimenPose }>;

export class LastChoice {
  private before: Moment | null = null;
  private left_s = 0;

  remember(now: Moment): void {
    this.before = now;
    this.left_s = UNDO_S;
  }

  /**
   * Advances the time. Returns whether there is a choice to undo.
   *
   * @param isRepeating the choice still moves something, so its time has not begun
   * @param isLookedAt *Undo* is looked at, so its time stands still
   */
  advance(dt_s: number, now: Moment, isRepeating: boolean, isLookedAt: boolean): boolean {
    if (isRepeating) this.left_s = UNDO_S;
    else if (!isLookedAt) this.left_s -= dt_s;
    if (this.left_s <= 0) this.before = null;
    const { before } = this;
    return before !== null && (before.state !== now.state || before.pose !== now.pose);
  }

  /** Returns and clears the stored moment; null if there is none. */
  take(): Moment | null {
    const { before } = this;
    this.before = null;
    return before;
  }
}
