/** Keeps a moving view within the frame's budget; a view at rest is drawn in full quality. */

import { GpuTimer, type TimedContext } from "../../gpu/gpu_timer";
import {
  advanceQuality,
  frameBudget_ms,
  initialQuality,
  type Quality,
  type QualityLevel,
  type QualitySettings,
  qualitySettings,
  withLevel,
} from "../../state/quality_controller";

const RATE_HZ = 60;
/**
 * Interval between two frames above which they are late, as a multiple of the display's interval.
 */
const LATE = 1.3;

export class FrameBudget {
  /** Smoothed time between two frames, ms. */
  frame_ms = 0;
  /** Whether the frames of a moving view come later than the display could show them. */
  isLate = false;
  settings: QualitySettings;
  private readonly timer: GpuTimer | null;
  private quality: Quality;
  private wasMoving = false;

  constructor(gl: TimedContext) {
    this.timer = GpuTimer.create(gl);
    this.quality = initialQuality(this.timer === null ? "interval" : "work");
    this.settings = qualitySettings(this.quality);
  }

  setLevel(level: QualityLevel): void {
    this.quality = withLevel(this.quality, level);
  }

  /**
   * Starts a frame and returns its quality settings.
   *
   * @param isMoving whether another frame follows by itself
   * @param rate_hz rate of the display, if known
   */
  begin(isMoving: boolean, interval_ms: number, rate_hz = RATE_HZ): QualitySettings {
    this.isLate = false;
    if (isMoving && this.wasMoving) {
      this.frame_ms += (interval_ms - this.frame_ms) / 8;
      const { timing } = this.quality;
      const budget_ms = frameBudget_ms(rate_hz, timing);
      const work_ms = timing === "work" ? (this.timer?.poll() ?? null) : interval_ms;
      // if frames are late or the timer has no answer, the GPU's own time is not reliable
      this.isLate = this.frame_ms > LATE * (1000 / rate_hz);
      const spent_ms = this.isLate ? Math.max(work_ms ?? 0, interval_ms) : work_ms;
      if (spent_ms !== null) this.quality = advanceQuality(this.quality, spent_ms, budget_ms);
    }
    this.wasMoving = isMoving;
    this.timer?.begin();
    const still: QualityLevel = this.quality.level === "low" ? "low" : "high";
    this.settings = qualitySettings(isMoving ? this.quality : { ...this.quality, level: still });
    return this.settings;
  }

  end(): void {
    this.timer?.end();
  }

  dispose(): void {
    this.timer?.dispose();
  }
}
