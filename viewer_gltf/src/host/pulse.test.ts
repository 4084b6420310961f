import type { WebGLRenderer } from "three";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Pulse } from "./pulse";

const FRAME_MS = 16;

describe("frames", () => {
  let beats = 0;
  let rests = true;
  let isPresenting = false;
  let end: () => void = () => {};
  let pulse: Pulse;

  beforeEach(() => {
    vi.useFakeTimers();
    vi.stubGlobal("requestAnimationFrame", (draw: FrameRequestCallback) =>
      setTimeout(() => draw(performance.now()), FRAME_MS),
    );
    vi.stubGlobal("cancelAnimationFrame", clearTimeout);
    [beats, rests, isPresenting] = [0, true, false];
    const renderer = {
      setAnimationLoop: () => {},
      xr: {
        get isPresenting() {
          return isPresenting;
        },
        setAnimationLoop: () => {},
        addEventListener: (_: string, ended: () => void) => {
          end = ended;
        },
      },
    } as unknown as WebGLRenderer;
    pulse = new Pulse(renderer, () => {
      beats++;
      return rests;
    });
    pulse.start();
  });

  afterEach(() => {
    pulse.stop();
    vi.unstubAllGlobals();
    vi.useRealTimers();
  });

  /** Number of frames in a time. */
  const beatsOf = (ms: number) => {
    const before = beats;
    vi.advanceTimersByTime(ms);
    return beats - before;
  };

  it("follow the screen while something changes, and for some time afterwards", () => {
    rests = false;
    expect(beatsOf(2000)).toBe(2000 / FRAME_MS);
    rests = true;
    expect(beatsOf(400)).toBe(400 / FRAME_MS);
  });

  it("are few at rest, and follow the screen at once after a change", () => {
    beatsOf(1000);
    expect(beatsOf(1000)).toBeLessThanOrEqual(10);
    pulse.wake();
    expect(beatsOf(FRAME_MS)).toBe(1);
    expect(beatsOf(160)).toBe(10);
  });

  it("detect a change by themselves", () => {
    beatsOf(1000);
    rests = false;
    beatsOf(120);
    expect(beatsOf(160)).toBe(10);
  });

  it("are one per frame of the screen, however often they are woken", () => {
    rests = false;
    for (let i = 0; i < 5; i++) pulse.wake();
    expect(beatsOf(160)).toBe(10);
  });

  it("are left to the headset while it presents", () => {
    isPresenting = true;
    expect(beatsOf(2000)).toBe(0);
    isPresenting = false;
    end();
    expect(beatsOf(160)).toBe(10);
  });

  it("end", () => {
    pulse.stop();
    pulse.wake();
    expect(beatsOf(1000)).toBe(0);
  });
});
