/** A head in a Cardboard viewer, in the page: it looks at controls of the panel, and trembles. */
import type { Page } from "playwright-core";
import { tick } from "../browser/clock";
import type { ViewerPage } from "../browser/page";
import { tremble } from "./tremble";

/** Milliseconds of a frame, the longest that counts in full. */
const FRAME_MS = 100;
/** Number of corrections until the gaze is at a place, because the eyes move with the neck. */
const CORRECTIONS = 4;
/**
 * Age of a report, ms, beyond which nothing is predicted, so that the head's rotation is the same
 * in every run.
 */
const OLD_MS = 1000;

/** Milliseconds of the phone's clock after which the direction of a resting head is straight ahead. */
const SETTLED_MS = 600;

/** The clock of the page must be held (see `addClock`). */
export class Gazer {
  private yaw_deg = 0;
  private pitch_deg = 0;
  private hasLooked = false;
  private readonly offsets = tremble(FRAME_MS / 1000);

  constructor(private readonly viewer: ViewerPage) {}

  private get page(): Page {
    return this.viewer.page;
  }

  /** Looks at the middle of a control of the panel, or at its button (`opener`). */
  async lookAt(id: string): Promise<void> {
    for (let i = 0; i < CORRECTIONS; i++) {
      const { menu } = await this.viewer.snapshot();
      const entry = menu.find((each) => each.id === id);
      if (entry === undefined) throw new Error(`no ${id} in ${menu.map((each) => each.id)}`);
      await this.turnTo(this.yaw_deg + entry.right_deg, entry.up_deg);
    }
  }

  /**
   * Turns to the right of the first direction, and up. The head rests at first, which defines
   * straight ahead.
   */
  async turnTo(yaw_deg: number, pitch_deg: number): Promise<void> {
    const isFirst = !this.hasLooked;
    this.hasLooked = true;
    [this.yaw_deg, this.pitch_deg] = [yaw_deg, pitch_deg];
    await this.report(0, 0);
    await tick(this.page, 10);
    if (!isFirst) return;
    await this.page.waitForTimeout(SETTLED_MS);
    await tick(this.page, 10);
  }

  /** Keeps looking at the same place, with the tremble of a head. */
  async rest(seconds: number): Promise<void> {
    for (let k = 0; k < Math.round((1000 * seconds) / FRAME_MS); k++) {
      await this.report(...(this.offsets.next().value as readonly [number, number]));
      await tick(this.page, FRAME_MS);
    }
  }

  private report(right_deg: number, up_deg: number): Promise<void> {
    const alpha = -this.yaw_deg - right_deg;
    const beta = 90 + this.pitch_deg + up_deg;
    return this.page.evaluate(
      ([angles, age_ms]) => {
        const event = new DeviceOrientationEvent("deviceorientation", { ...angles, gamma: 0 });
        Object.defineProperty(event, "timeStamp", { value: performance.now() - age_ms });
        dispatchEvent(event);
      },
      [{ alpha, beta }, OLD_MS] as const,
    );
  }
}
