import { describe, expect, it } from "vitest";
import { RedrawAtRest } from "./redraw_at_rest";

/**
 * A GPU that takes `picture_ms` for an image. Returns the times, ms, at which images were
 * requested.
 */
function run(picture_ms: number, until_ms: number): number[] {
  let now = 0;
  let doneAt = 0;
  const gl = {
    fenceSync: () => ({}) as WebGLSync,
    getSyncParameter: () => (now >= doneAt ? 0x9119 : 0),
    deleteSync: () => undefined,
    flush: () => undefined,
  };
  const pace = new RedrawAtRest(gl);
  const asked: number[] = [];
  for (; now < until_ms; now += 10) {
    if (!pace.isDue(now)) continue;
    asked.push(now);
    doneAt = now + picture_ms;
    pace.submit(now);
  }
  return asked;
}

describe("a view at rest while data arrive", () => {
  it("is drawn at once, and then at the rate of the display if that is little work", () => {
    expect(run(5, 40)).toEqual([0, 10, 20, 30]);
    expect(run(40, 100)).toEqual([0, 40, 80]);
  });

  it("leaves half of the time to loading", () => {
    expect(run(400, 2000)).toEqual([0, 800, 1600]);
  });

  it("waits for at most a second after a frame, even a very slow one", () => {
    expect(run(60_000, 62_000)).toEqual([0, 61_000]);
  });

  it("does not wait for a lost context", () => {
    const gl = {
      fenceSync: () => ({}) as WebGLSync,
      getSyncParameter: () => 0,
      deleteSync: () => undefined,
      flush: () => undefined,
    };
    const pace = new RedrawAtRest(gl);
    pace.submit(0);
    expect(pace.isDue(5000)).toBe(false);
    pace.forget();
    expect(pace.isDue(5000)).toBe(true);
  });
});
