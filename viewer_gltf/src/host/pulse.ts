/**
 * Decides when frames are due: with the screen's frames while something changes, else ten times a
 * second.
 *
 * A check at each frame of the screen would take a fifth of a slow core, and of a phone's battery.
 */
import type { WebGLRenderer } from "three";

/** Milliseconds for which frames go on after the last change. */
const AWAKE_MS = 500;
/** Milliseconds between two checks for a change at rest. */
const CHECK_MS = 100;

export class Pulse {
  /** Id of the window's next frame; 0: none is requested. */
  private request = 0;
  /** Timer of the next check. */
  private timer: ReturnType<typeof setTimeout> | undefined;
  private isOn = false;
  private changed_ms = 0;

  /** @param beat draws a frame if needed; returns whether nothing will change without `wake` */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly beat: (time_ms: number) => boolean,
  ) {
    renderer.xr.addEventListener("sessionend", () => {
      if (!this.isOn) return;
      this.stop(); // three.js starts its own loop in the window at this point
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
    this.renderer.setAnimationLoop(null); // also in a headset
    cancelAnimationFrame(this.request);
    clearTimeout(this.timer);
    this.request = 0;
  }

  /** Draws again soon, because something has changed. */
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
    else this.timer = setTimeout(() => this.next(), CHECK_MS);
  }
}
