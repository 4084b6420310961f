/**
 * Controls the frames of a page one by one, so that fades and rests do not depend on the speed of
 * the machine.
 */
import type { Page } from "playwright-core";

type Clock = { now_ms: number; isHeld: boolean; run: (time_ms: number) => void };

declare global {
  interface Window {
    frameClock?: Clock;
  }
}

/** Gives the page a clock that follows real time until it is held. Must be called before the page opens. */
export async function addClock(page: Page): Promise<void> {
  await page.addInitScript(() => {
    const real = window.requestAnimationFrame.bind(window);
    let last = 0;
    let waiting = new Map<number, FrameRequestCallback>();
    const clock: Clock = {
      now_ms: 0,
      isHeld: false,
      run(time_ms: number) {
        clock.now_ms = time_ms;
        const now = waiting;
        waiting = new Map();
        for (const callback of now.values()) callback(time_ms);
      },
    };
    const follow = (time_ms: number) => {
      if (!clock.isHeld) clock.run(time_ms);
      real(follow);
    };
    real(follow);
    window.requestAnimationFrame = (callback) => {
      waiting.set(++last, callback);
      return last;
    };
    window.cancelAnimationFrame = (id) => {
      waiting.delete(id);
    };
    window.frameClock = clock;
  });
}

/** Stops the clock, which advances only by `tick` from then on. */
export async function holdFrames(page: Page): Promise<void> {
  await page.evaluate(() => {
    if (window.frameClock === undefined) throw new Error("the page has no clock");
    window.frameClock.isHeld = true;
  });
}

/** Draws frames at intervals of `each_ms`. */
export async function tick(page: Page, each_ms: number, frames = 1): Promise<void> {
  await page.evaluate(
    ([ms, count]) => {
      const { frameClock } = window;
      if (frameClock === undefined) throw new Error("the page has no clock");
      for (let i = 0; i < count; i++) frameClock.run(frameClock.now_ms + ms);
    },
    [each_ms, frames] as const,
  );
}
