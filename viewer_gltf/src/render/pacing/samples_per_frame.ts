/**
 * Number of samples that a frame of a path-traced view at rest takes: as many as keep the page
 * responsive. A browser accepts more work than the GPU can do, so each frame waits until the last
 * one is done.
 */

/** Milliseconds. Longest frame at rest, so that the page still reacts at once. */
const FRAME_MS = 60;
const MAX_SAMPLES = 16;
const MIN_SAMPLES = 1 / 64;

/** The part of WebGL 2 in use, so that tests need no GPU. */
export type FencedContext = Pick<
  WebGL2RenderingContext,
  "fenceSync" | "getSyncParameter" | "deleteSync" | "flush"
>;
const SYNC_GPU_COMMANDS_COMPLETE = 0x9117;
const SYNC_STATUS = 0x9114;
const SIGNALED = 0x9119;

export class SamplesPerFrame {
  /** Samples per pixel in the next frame; below 1 it is the share of the pixels that are drawn. */
  passes = 1 / 8;
  private fence: WebGLSync | null = null;
  private began_ms = 0;

  constructor(private readonly gl: FencedContext) {}

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

  submit(now_ms: number): void {
    this.began_ms = now_ms;
    if (this.fence !== null) this.gl.deleteSync(this.fence);
    this.fence = this.gl.fenceSync(SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
  }

  /** Forgets the frame that was waited for, after the context was lost. */
  forget(): void {
    this.fence = null;
  }
}
