/**
 * How many samples a frame of a path-traced picture at rest takes: as many as keep the page alive. A
 * browser takes more work than the GPU has done; so each frame waits until the one before is done.
 */

/** Longest frame at rest, ms: the page still answers at once. */
const FRAME_MS = 60;
const MAX_SAMPLES = 16;
const MIN_SAMPLES = 1 / 64;

/** The part of WebGL 2 in use, so that tests need none. */
export type FencedContext = Pick<
  WebGL2RenderingContext,
  "fenceSync" | "getSyncParameter" | "deleteSync" | "flush"
>;
const SYNC_GPU_COMMANDS_COMPLETE = 0x9117;
const SYNC_STATUS = 0x9114;
const SIGNALED = 0x9119;

export class GatherPace {
  /** Samples of every pixel in the next frame; below 1, of so many pixels. */
  passes = 1 / 8;
  private fence: WebGLSync | null = null;
  private began_ms = 0;

  constructor(private readonly gl: FencedContext) {}

  /** Whether the frame before is done. */
  isReady(now_ms: number): boolean {
    const { fence, gl } = this;
    if (fence === null) return true;
    if (gl.getSyncParameter(fence, SYNC_STATUS) !== SIGNALED) return false;
    gl.deleteSync(fence);
    this.fence = null;
    const spent_ms = now_ms - this.began_ms;
    if (spent_ms < FRAME_MS / 2) this.passes = Math.min(MAX_SAMPLES, 2 * this.passes);
    else if (spent_ms > FRAME_MS) this.passes = Math.max(MIN_SAMPLES, this.passes / 2);
    return true;
  }

  /** A frame at rest has been asked for. */
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
