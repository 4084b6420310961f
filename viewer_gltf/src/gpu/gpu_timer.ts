/**
 * Measures how long the GPU works on a frame, with EXT_disjoint_timer_query_webgl2. Answers arrive
 * a few frames late and are never waited for.
 */

/** From the extension's registry entry; TypeScript's DOM types lack it. */
const TIME_ELAPSED = 0x88bf;
const GPU_DISJOINT = 0x8fbb;
/** Largest number of queries without an answer, since a driver may never answer. */
const MAX_PENDING = 8;

export type TimedContext = Pick<
  WebGL2RenderingContext,
  | "getExtension"
  | "createQuery"
  | "deleteQuery"
  | "beginQuery"
  | "endQuery"
  | "getQueryParameter"
  | "getParameter"
  | "QUERY_RESULT"
  | "QUERY_RESULT_AVAILABLE"
>;

export class GpuTimer {
  private readonly pending: WebGLQuery[] = [];
  private readonly free: WebGLQuery[] = [];
  private current: WebGLQuery | null = null;

  private constructor(private readonly gl: TimedContext) {}

  /** Returns null without the extension; then only the time between frames is known. */
  static create(gl: TimedContext): GpuTimer | null {
    return gl.getExtension("EXT_disjoint_timer_query_webgl2") === null ? null : new GpuTimer(gl);
  }

  /** Call it before the frame's first draw call. */
  begin(): void {
    if (this.current !== null || this.pending.length >= MAX_PENDING) return;
    const query = this.free.pop() ?? this.gl.createQuery();
    if (query === null) return; // the context is lost
    this.gl.beginQuery(TIME_ELAPSED, query);
    this.current = query;
  }

  /** Call it after the frame's last draw call. */
  end(): void {
    if (this.current === null) return;
    this.gl.endQuery(TIME_ELAPSED);
    this.pending.push(this.current);
    this.current = null;
  }

  /** Returns the time of the newest frame answered since the last call, ms, or null. */
  poll(): number | null {
    const { gl } = this;
    // The clock was interrupted (the GPU changed its rate, the laptop slept), so pending queries
    // are invalid.
    if (gl.getParameter(GPU_DISJOINT) === true) {
      this.free.push(...this.pending.splice(0));
      return null;
    }
    let time_ms: number | null = null;
    for (;;) {
      const [query] = this.pending;
      if (query === undefined) return time_ms;
      if (gl.getQueryParameter(query, gl.QUERY_RESULT_AVAILABLE) !== true) return time_ms;
      const time_ns: unknown = gl.getQueryParameter(query, gl.QUERY_RESULT);
      if (typeof time_ns === "number") time_ms = time_ns / 1e6;
      this.pending.shift();
      this.free.push(query);
    }
  }

  dispose(): void {
    this.end();
    for (const query of [...this.pending.splice(0), ...this.free.splice(0)]) {
      this.gl.deleteQuery(query);
    }
  }
}
