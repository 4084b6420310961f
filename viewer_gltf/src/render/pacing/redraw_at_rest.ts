/**
 * Decides when a view at rest is drawn again while data arrive: when the last image is done, and
 * after a further wait as long as that image took. So loading gets half of the time on any GPU.
 */
import type { FencedContext } from "./samples_per_frame";

/** Milliseconds. After an image as quick as this there is no further wait. */
const LITTLE_MS = 50;
/**
 * Milliseconds. Longest time that counts for one image, since a page that slept did not draw all
 * that time.
 */
const MAX_MS = 1000;
const SYNC_GPU_COMMANDS_COMPLETE = 0x9117;
const SYNC_STATUS = 0x9114;
const SIGNALED = 0x9119;

export class RedrawAtRest {
  private fence: WebGLSync | null = null;
  private began_ms = 0;
  private due_ms = 0;

  constructor(private readonly gl: FencedContext) {}

  /** Whether another image may be requested. Call it in every frame of the display. */
  isDue(now_ms: number): boolean {
    const { fence, gl } = this;
    if (fence !== null && gl.getSyncParameter(fence, SYNC_STATUS) === SIGNALED) {
      gl.deleteSync(fence);
      this.fence = null;
      const spent_ms = now_ms - this.began_ms;
      this.due_ms = now_ms + (spent_ms > LITTLE_MS ? Math.min(MAX_MS, spent_ms) : 0);
    }
    return this.fence === null && now_ms >= this.due_ms;
  }

  submit(now_ms: number): void {
    this.began_ms = now_ms;
    if (this.fence !== null) this.gl.deleteSync(this.fence);
    this.fence = this.gl.fenceSync(SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
  }

  /** Forgets the image that was waited for, after the context was lost. */
  forget(): void {
    this.fence = null;
  }
}
