/** The moment before the last choice in stereo, to which the bar's *Undo* leads back for a few seconds. */
import type { SpecimenPose } from "../math/grab";
import type { ViewerState } from "../state/viewer_state";

/** Time after a choice in which it can be undone, s. */
const UNDO_S = 4;

/** All that a choice can change. */
export type Moment = Readonly<{ state: ViewerState; pose: SpecimenPose }>;

export class LastChoice {
  private before: Moment | null = null;
  private left_s = 0;

  /** A choice is about to be made. */
  remember(now: Moment): void {
    this.before = now;
    this.left_s = UNDO_S;
  }

  /**
   * Time passes; whether there is anything to undo.
   *
   * @param isGoingOn the choice still moves something, so that its time has not begun
   * @param isAsked *Undo* is looked at, so that it stays
   */
  advance(dt_s: number, now: Moment, isGoingOn: boolean, isAsked: boolean): boolean {
    if (isGoingOn) this.left_s = UNDO_S;
    else if (!isAsked) this.left_s -= dt_s;
    if (this.left_s <= 0) this.before = null;
    const { before } = this;
    return before !== null && (before.state !== now.state || before.pose !== now.pose);
  }

  /** The moment to go back to, once; null: there is none. */
  take(): Moment | null {
    const { before } = this;
    this.before = null;
    return before;
  }
}
