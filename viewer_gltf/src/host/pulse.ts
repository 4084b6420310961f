/**
 * When frames are due: with the screen's while something changes, else ten times a second.
 *
 * To ask each of the screen's frames whether anything has changed takes a fifth of a slow core, and
 * of a phone's charge.
 */
import type { WebGLRenderer } from "three";

/** Frames go on for so long after the last that changed anything, ms. */
const AWAKE_MS = 500;
/** Between two looks whether something has changed after all, ms. */
const LOOK_MS = 100;

export class Pulse {
  /** Of the window's next frame; 0: none is asked for. */
  private request = 0;
  /** Until the next look. */
  private timer: ReturnType<typeof setTimeout> | undefined;
  private isOn = false;
  private changed_ms = 0;

  /** @param beat draws what there is to draw; whether nothing more is to come of itself */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly beat: (time_ms: number) => boolean,
  ) {
    renderer.xr.addEventListener("sessionend", () => {
      if (!this.isOn) return;
      this.stop(); // three's own loop in the window, too, which it starts now
      this.start();
    });
  }

  start(): void {
    this.isOn = true;
    this.renderer.xr.setAnimationLoop(this.beat);
    this.wake();
  }

  stop(): void {
    this.isOn = false;
    this.renderer.setAnimationLoop(null); // in a headset, too
    cancelAnimationFrame(this.request);
    clearTimeout(this.timer);
    this.request = 0;
  }

  /** Something has changed. */
  wake(): void {
    this.changed_ms = performance.now();
    if (this.isOn && this.request === 0) this.next();
  }

  private next(): void {
    clearTimeout(this.timer);
    this.request = requestAnimationFrame((time_ms) => this.inWindow(time_ms));
  }

  private inWindow(time_ms: number): void {
    this.request = 0;
    // a headset has frames of its own
    const rests = this.renderer.xr.isPresenting || this.beat(time_ms);
    if (!rests) this.wake();
    if (!this.isOn || this.request !== 0) return;
    if (performance.now() - this.changed_ms < AWAKE_MS) this.next();
    else this.timer = setTimeout(() => this.next(), LOOK_MS);
  }
}
