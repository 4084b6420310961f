import { describe, expect, it } from "vitest";
import { holdScreen, type ScreenHost } from "./screen";

/** A page of a browser that offers all or some of the features. */
function fakePage({ canFill = true, canLock = true, canWake = true } = {}) {
  const log: string[] = [];
  const document = Object.assign(new EventTarget(), {
    fullscreenElement: null as object | null,
    visibilityState: "visible",
    exitFullscreen: async () => {
      log.push("leave");
      document.fullscreenElement = null;
    },
  });
  const element = {
    requestFullscreen: canFill
      ? async () => {
          log.push("fill");
          document.fullscreenElement = element;
        }
      : undefined,
  };
  const host = {
    document,
    navigator: {
      wakeLock: canWake
        ? {
            request: async () => {
              log.push("wake");
              return { release: async () => void log.push("sleep") };
            },
          }
        : undefined,
    },
    screen: {
      orientation: {
        lock: async () => {
          log.push("lock");
          if (!canLock) throw new DOMException("no", "NotSupportedError");
        },
        unlock: () => void log.push("unlock"),
      },
    },
  };
  return {
    log,
    document,
    element: element as unknown as HTMLElement,
    host: host as unknown as ScreenHost,
  };
}

describe("the phone's screen", () => {
  it("is held in full screen, and released once", async () => {
    const { log, element, host } = fakePage();
    const hold = await holdScreen(element, () => log.push("left"), host);
    expect(hold.problems).toEqual([]);
    expect(log).toEqual(["wake", "fill", "lock"]);
    hold.release();
    hold.release();
    expect(log).toEqual(["wake", "fill", "lock", "sleep", "unlock", "leave"]);
  });

  it("reports each refused feature on its own", async () => {
    const { element, host } = fakePage({ canFill: false, canLock: false, canWake: false });
    const { problems } = await holdScreen(element, () => undefined, host);
    // A phone that can't be locked is turned by hand: see turn_sign.ts.
    expect(problems).toHaveLength(2);
    expect(problems.join(" ")).toMatch(/home screen.*dim/);
    const android = fakePage({ canWake: false });
    const { problems: few } = await holdScreen(android.element, () => undefined, android.host);
    expect(few).toEqual([expect.stringContaining("dim")]);
  });

  it("is kept awake again when the page becomes visible", async () => {
    const { log, document, element, host } = fakePage();
    const hold = await holdScreen(element, () => undefined, host);
    document.visibilityState = "hidden";
    document.dispatchEvent(new Event("visibilitychange"));
    document.visibilityState = "visible";
    document.dispatchEvent(new Event("visibilitychange"));
    expect(log.filter((each) => each === "wake")).toHaveLength(2);
    hold.release();
    document.dispatchEvent(new Event("visibilitychange"));
    expect(log.filter((each) => each === "wake")).toHaveLength(2);
  });

  it("reports when the user leaves full screen", async () => {
    const { log, document, element, host } = fakePage();
    const hold = await holdScreen(element, () => log.push("left"), host);
    document.dispatchEvent(new Event("fullscreenchange")); // full screen was entered
    expect(log).not.toContain("left");
    document.fullscreenElement = null;
    document.dispatchEvent(new Event("fullscreenchange"));
    expect(log).toContain("left");
    hold.release();
    expect(log).not.toContain("leave");
  });
});
