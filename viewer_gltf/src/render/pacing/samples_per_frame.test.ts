import { describe, expect, it } from "vitest";
import { SamplesPerFrame } from "./samples_per_frame";

/** A GPU whose frame time depends on the number of samples. */
function stand(msOf: (passes: number) => number) {
  let now = 0;
  let doneAt = 0;
  const gl = {
    fenceSync: () => ({}) as WebGLSync,
    getSyncParameter: () => (now >= doneAt ? 0x9119 : 0),
    deleteSync: () => undefined,
    flush: () => undefined,
  };
  const pace = new SamplesPerFrame(gl);
  /** Advances one display frame of 16 ms. Returns whether an image was requested. */
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
  it("requests a frame only when the last one is done", () => {
    const { step } = stand(() => 100);
    expect(Array.from({ length: 8 }, step)).toEqual([
      true,
      ...new Array(6).fill(false), // after 16 to 96 ms
      true,
    ]);
  });

  it("takes as many samples as fit in a frame", () => {
    const { pace, step } = stand((passes) => 20 * passes);
    for (let i = 0; i < 100; i++) step();
    expect(pace.passes).toBeGreaterThanOrEqual(1);
    expect(pace.passes).toBeLessThanOrEqual(4);
  });

  it("draws a part of the pixels if one sample per pixel takes too long", () => {
    const { pace, step } = stand((passes) => 2000 * passes);
    for (let i = 0; i < 400; i++) step();
    expect(pace.passes).toBeLessThanOrEqual(1 / 32);
    expect(pace.passes).toBeGreaterThanOrEqual(1 / 64);
  });
});
