import { describe, expect, it } from "vitest";
import { RestPace } from "./redraw_at_rest";

/** A GPU with pictures of this length; the milliseconds at which one was asked for. */
function run(picture_ms: number, until_ms: number): number[] {
  let now = 0;
  let doneAt = 0;
  const gl = {
    fenceSync: () => ({}) as WebGLSync,
    getSyncParameter: () => (now >= doneAt ? 0x9119 : 0),
    deleteSync: () => undefined,
    flush: () => undefined,
  };
  const pace = new RestPace(gl);
  const asked: number[] = [];
  for (; now < until_ms; now += 10) {
    if (!pace.isDue(now)) continue;
    asked.push(now);
    doneAt = now + picture_ms;
    pace.submit(now);
  }
  return asked;
}

describe("a picture at rest, for which things come", () => {
  it("is drawn at once, and then as often as the display can where that is little work", () => {
    expect(run(5, 40)).toEqual([0, 10, 20, 30]);
    expect(run(40, 100)).toEqual([0, 40, 80]);
  });

  it("leaves half of the time to what comes", () => {
    expect(run(400, 2000)).toEqual([0, 800, 1600]);
  });

  it("is not put off by more than a second, however long one took", () => {
    expect(run(60_000, 62_000)).toEqual([0, 61_000]);
  });

  it("waits for nothing of a context that is gone", () => {
    const gl = {
      fenceSync: () => ({}) as WebGLSync,
      getSyncParameter: () => 0,
      deleteSync: () => undefined,
      flush: () => undefined,
    };
    const pace = new RestPace(gl);
    pace.submit(0);
    expect(pace.isDue(5000)).toBe(false);
    pace.forget();
    expect(pace.isDue(5000)).toBe(true);
  });
});
