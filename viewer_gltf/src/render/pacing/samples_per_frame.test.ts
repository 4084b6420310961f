import { describe, expect, it } from "vitest";
import { GatherPace } from "./samples_per_frame";

/** A GPU with frames of this length, by the number of samples. */
function stand(msOf: (passes: number) => number) {
  let now = 0;
  let doneAt = 0;
  const gl = {
    fenceSync: () => ({}) as WebGLSync,
    getSyncParameter: () => (now >= doneAt ? 0x9119 : 0),
    deleteSync: () => undefined,
    flush: () => undefined,
  };
  const pace = new GatherPace(gl);
  /** One display frame of 16 ms; whether a picture was asked for. */
  const step = () => {
    now += 16;
    if (!pace.isReady(now)) return false;
    doneAt = now + msOf(pace.passes);
    pace.submit(now);
    return true;
  };
  return { pace, step };
}

describe("gathering at rest", () => {
  it("asks for no frame before the last one is done", () => {
    const { step } = stand(() => 100);
    expect(Array.from({ length: 8 }, step)).toEqual([
      true,
      ...new Array(6).fill(false), // 16 to 96 ms later
      true,
    ]);
  });

  it("takes as many samples as a frame has room for", () => {
    const { pace, step } = stand((passes) => 20 * passes);
    for (let i = 0; i < 100; i++) step();
    expect(pace.passes).toBeGreaterThanOrEqual(1);
    expect(pace.passes).toBeLessThanOrEqual(4);
  });

  it("draws a part of the pixels where one sample is too much", () => {
    const { pace, step } = stand((passes) => 2000 * passes);
    for (let i = 0; i < 400; i++) step();
    expect(pace.passes).toBeLessThanOrEqual(1 / 32);
    expect(pace.passes).toBeGreaterThanOrEqual(1 / 64);
  });
});
