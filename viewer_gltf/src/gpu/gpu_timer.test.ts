import { describe, expect, it } from "vitest";
import { GpuTimer, type TimedContext } from "./gpu_timer";

const RESULT = 1;
const AVAILABLE = 2;

/** A context with a GPU that answers on demand. */
function standIn(hasExtension = true) {
  const results = new Map<WebGLQuery, number>();
  const ended: WebGLQuery[] = [];
  const queries = { made: 0, deleted: 0, running: false, isDisjoint: false };
  let current: WebGLQuery | null = null;
  const gl = {
    QUERY_RESULT: RESULT,
    QUERY_RESULT_AVAILABLE: AVAILABLE,
    getExtension: () => (hasExtension ? {} : null),
    createQuery: () => ({ id: queries.made++ }),
    deleteQuery: () => void queries.deleted++,
    beginQuery: (_: number, query: WebGLQuery) => {
      if (current !== null) throw new Error("two queries at a time");
      current = query;
      results.delete(query);
    },
    endQuery: () => {
      if (current === null) throw new Error("no query");
      ended.push(current);
      current = null;
    },
    getQueryParameter: (query: WebGLQuery, name: number) =>
      name === AVAILABLE ? results.has(query) : results.get(query),
    getParameter: () => queries.isDisjoint,
  };
  const answer = (time_ns: number) => {
    const query = ended.shift();
    if (query !== undefined) results.set(query, time_ns);
  };
  return { gl: gl as unknown as TimedContext, answer, queries };
}

function frame(timer: GpuTimer | null): void {
  timer?.begin();
  timer?.end();
}

describe("the GPU time", () => {
  it("is unknown without the extension", () => {
    expect(GpuTimer.create(standIn(false).gl)).toBeNull();
  });

  it("is that of the newest answered frame, in ms, and is reported once", () => {
    const { gl, answer } = standIn();
    const timer = GpuTimer.create(gl);
    for (let i = 0; i < 3; i++) frame(timer);
    expect(timer?.poll()).toBeNull();
    answer(5e6);
    answer(7e6);
    expect(timer?.poll()).toBe(7);
    expect(timer?.poll()).toBeNull();
    answer(9e6);
    expect(timer?.poll()).toBe(9);
  });

  it("uses a limited number of queries if the driver never answers", () => {
    const { gl, answer, queries } = standIn();
    const timer = GpuTimer.create(gl);
    for (let i = 0; i < 100; i++) frame(timer);
    expect(queries.made).toBe(8);
    for (let i = 0; i < 100; i++) {
      answer(1e6 * (i + 1));
      expect(timer?.poll()).toBe(i + 1);
      frame(timer);
    }
    expect(queries.made).toBe(8);
    timer?.dispose();
    expect(queries.deleted).toBe(8);
  });

  it("is not read after the clock was interrupted", () => {
    const { gl, answer, queries } = standIn();
    const timer = GpuTimer.create(gl);
    frame(timer);
    answer(3e6);
    queries.isDisjoint = true;
    expect(timer?.poll()).toBeNull();
    queries.isDisjoint = false;
    expect(timer?.poll()).toBeNull();
    frame(timer);
    answer(4e6);
    expect(timer?.poll()).toBe(4);
  });

  it("ignores a begin or an end without its counterpart", () => {
    const { gl } = standIn();
    const timer = GpuTimer.create(gl);
    timer?.end();
    timer?.begin();
    timer?.begin();
    timer?.end();
    expect(timer?.poll()).toBeNull();
    timer?.begin();
    timer?.dispose();
  });
});
