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

  /** Of so long. */
  const beatsOf = (ms: number) => {
    const before = beats;
    vi.advanceTimersByTime(ms);
    return beats - before;
  };

  it("follow the screen while something changes, and some time after", () => {
    rests = false;
    expect(beatsOf(2000)).toBe(2000 / FRAME_MS);
    rests = true;
    expect(beatsOf(400)).toBe(400 / FRAME_MS);
  });

  it("are few at rest, and as many as before at once where something changes", () => {
    beatsOf(1000);
    expect(beatsOf(1000)).toBeLessThanOrEqual(10);
    pulse.wake();
    expect(beatsOf(FRAME_MS)).toBe(1);
    expect(beatsOf(160)).toBe(10);
  });

  it("find by themselves that something changes", () => {
    beatsOf(1000);
    rests = false;
    beatsOf(120);
    expect(beatsOf(160)).toBe(10);
  });

  it("are one for each of the screen's, whoever wakes them", () => {
    rests = false;
    for (let i = 0; i < 5; i++) pulse.wake();
    expect(beatsOf(160)).toBe(10);
  });

  it("are the headset's while it has some", () => {
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
