/** Keeps a moving picture in the frame's budget; a still one is drawn as well as can be. */
import {
  advanceQuality,
  frameBudget_ms,
  initialQuality,
  type Quality,
  type QualityLevel,
  type QualitySettings,
  qualitySettings,
  withLevel,
} from "./controller";
import { GpuTimer, type TimedContext } from "./gpu_timer";

const RATE_HZ = 60;

export class Pace {
  /** Between the last two frames, smoothed. */
  frame_ms = 0;
  /** What the last frame was drawn with. */
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
   * What to draw the next frame with.
   *
   * @param isMoving whether another frame follows by itself
   * @param rate_hz of the display, where it is known
   */
  begin(isMoving: boolean, interval_ms: number, rate_hz = RATE_HZ): QualitySettings {
    if (isMoving && this.wasMoving) {
      this.frame_ms += (interval_ms - this.frame_ms) / 8;
      const { timing } = this.quality;
      const spent = timing === "work" ? (this.timer?.poll() ?? null) : interval_ms;
      if (spent !== null) {
        this.quality = advanceQuality(this.quality, spent, frameBudget_ms(rate_hz, timing));
      }
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

  /** The context was lost: nothing pending will be answered. */
  dispose(): void {
    this.timer?.dispose();
  }
}
