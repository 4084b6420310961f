/**
 * When a picture at rest is drawn anew while things come for it: the one before is done then, and if
 * that took long, as long again has gone by. So what loads has half of the time, whatever draws.
 */
import type { FencedContext } from "./samples_per_frame";

/** Time of a quick picture, ms: it keeps nothing waiting. */
const LITTLE_MS = 50;
/** Longest time that a picture counts, ms: a page that slept did not draw for as long. */
const MAX_MS = 1000;
const SYNC_GPU_COMMANDS_COMPLETE = 0x9117;
const SYNC_STATUS = 0x9114;
const SIGNALED = 0x9119;

export class RestPace {
  private fence: WebGLSync | null = null;
  private began_ms = 0;
  private due_ms = 0;

  constructor(private readonly gl: FencedContext) {}

  /** Whether another picture may be asked for. To be called in every frame of the display. */
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

  /** A picture at rest has been asked for. */
  submit(now_ms: number): void {
    this.began_ms = now_ms;
    if (this.fence !== null) this.gl.deleteSync(this.fence);
    this.fence = this.gl.fenceSync(SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
  }

  /** The context was lost, and with it what was waited for. */
  forget(): void {
    this.fence = null;
  }
}
