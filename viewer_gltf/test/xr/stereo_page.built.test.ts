/** The whole page in stereo: what hands and gaze do, and how stereo ends. */
import type { Page } from "playwright-core";
import { expect, it } from "vitest";
import { addHeadset, restBetweenFrames } from "../support/browser/chromium";
import { addClock, holdFrames, tick } from "../support/browser/clock";
import { isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";

type Headset = import("iwer").XRDevice;

/** Orientations: to the floor, and straight ahead. */
const DOWN = [-Math.SQRT1_2, 0, 0, Math.SQRT1_2] as const;
const AHEAD = [0, 0, 0, 1] as const;
/** Milliseconds after which a second press is not part of a double press and counts. */
const PRESS_APART_MS = 500;

/** Points both controllers of the page's headset, beside the head, in this direction. */
function pointHands(page: Page, turn: readonly [number, number, number, number]): Promise<void> {
  return page.evaluate((quaternion) => {
    const { headset } = window as unknown as { headset: Headset };
    for (const hand of ["left", "right"] as const) {
      const controller = headset.controllers[hand];
      if (controller === undefined) throw new Error(`there is no ${hand} controller`);
      controller.position.set(hand === "left" ? -0.2 : 0.2, 1.5, -0.1);
      controller.quaternion.set(...quaternion);
    }
  }, turn);
}

describeInChromium("a headset's frame", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 270 }, bundle: DEMO_BUNDLE });

  it("takes fewer than 60 draw calls with both controllers, also with volumes and slices", async () => {
    const { viewer } = stand;
    await addHeadset(viewer.page);
    await stand.open("&mode=off&switch=9&quality=auto");
    await viewer.enterStereo();
    await pointHands(viewer.page, AHEAD);
    const calls: Record<string, number> = {};
    for (const mode of ["off", "all", "disc", "slices"]) {
      if (mode === "slices")
        await viewer.page.keyboard.press("|"); // slices together with the disc
      else await viewer.page.locator("select[data-mode]").selectOption(mode);
      await viewer.settled();
      await viewer.page.waitForTimeout(500);
      const { drawCalls, volumes, state } = await viewer.snapshot();
      expect(volumes.length > 0, mode).toBe(mode !== "off");
      expect(state.hasSlicePlanes).toBe(mode === "slices");
      calls[mode] = drawCalls;
    }
    expect(Math.max(...Object.values(calls)), JSON.stringify(calls)).toBeLessThan(60);
    expect(Math.min(...Object.values(calls))).toBeGreaterThan(10); // so something is drawn
  });
});

describeInChromium("the page in stereo", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 270 } });
  const state = async () => (await stand.viewer.snapshot()).state;
  const notices = async () => (await state()).notices;
  const undo = () => stand.viewer.page.locator('[data-control="undo"]');

  const isFull = () => stand.viewer.page.evaluate(() => document.fullscreenElement !== null);

  /**
   * Opens the page in stereo with the controllers away from the specimen, so that only the gaze
   * points at it.
   */
  async function open(query: string, hasHands: boolean): Promise<void> {
    await addHeadset(stand.viewer.page);
    await stand.open(query);
    await stand.viewer.enterStereo();
    await pointHands(stand.viewer.page, hasHands ? AHEAD : DOWN);
  }

  it("selects the target that is looked at for 1.5 s, and nothing with dwell off", async () => {
    await open("&mode=off", false);
    await expect.poll(async () => (await state()).selected).not.toBeNull();
    expect((await state()).isolated).toBeNull(); // chosen once, not twice
    expect(await undo().isDisabled()).toBe(true); // no setting was changed
  });

  const LOOKED_AT = [
    ["the place that was looked at on the screen", false, "r0_c1"],
    ["the side that was turned to the screen", true, "r0_c0"],
  ] as const;
  it.each(sweep(LOOKED_AT, ([, isTurned]) => isTurned))("shows %s", async (_, isTurned, tile) => {
    await addHeadset(stand.viewer.page);
    await stand.open("&mode=tile&switch=9");
    const press = async (key: string, n: number) => {
      for (let i = 0; i < n; i++) await stand.viewer.page.keyboard.press(key);
    };
    if (isTurned) await press("ArrowRight", 12); // half a turn: the left side is on the right now
    await press("Shift+ArrowRight", 4);
    await stand.viewer.settled();
    const gazed = async () => (await stand.viewer.snapshot()).gazed;
    await expect.poll(gazed).toBe(tile);
    await stand.viewer.enterStereo();
    await expect.poll(gazed).toBe(tile);
  });

  /**
   * Waits until this number of frames has begun and ended. On a busy machine one frame can take
   * longer than a press.
   */
  async function drawFrames(count: number): Promise<void> {
    const { page } = stand.viewer;
    const before = await page.evaluate(() => window.stereocell?.frames ?? 0);
    const least = before + count;
    await page.waitForFunction((n) => (window.stereocell?.frames ?? 0) > n, least);
  }

  it("selects with the trigger, and isolates with the next press", async () => {
    await open("&mode=off", true);
    const press = async () => {
      for (const value of [1, 0]) {
        await stand.viewer.page.evaluate((each) => {
          const { headset } = window as unknown as { headset: Headset };
          headset.controllers.right?.updateButtonValue("trigger", each);
        }, value);
        await drawFrames(2);
      }
    };
    await press();
    await expect.poll(async () => (await state()).selected).not.toBeNull();
    expect(await undo().isDisabled()).toBe(false);
    await stand.viewer.page.waitForTimeout(PRESS_APART_MS);
    await press();
    await expect.poll(async () => (await state()).isolated).not.toBeNull();
  });

  it("goes back to the flat screen when the session ends", async () => {
    await open("&mode=off", false);
    await stand.viewer.page.evaluate(() =>
      (window as unknown as { headset: Headset }).headset.activeSession?.end(),
    );
    await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(false);
    await stand.viewer.settled();
    const picture = await takePicture(stand.viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    expect(await notices()).toEqual([]);
  });

  /** Adds an iPhone's permission API, which allows a question only within the call of a click. */
  async function addIphone(answer: "granted" | "denied"): Promise<void> {
    await stand.viewer.page.addInitScript((given) => {
      let isInTap = false;
      const leaveTap = new MessageChannel();
      leaveTap.port1.onmessage = () => {
        isInTap = false;
      };
      const enterTap = () => {
        isInTap = true;
        leaveTap.port2.postMessage(null);
      };
      addEventListener("click", enterTap, { capture: true });
      const requestPermission = async () => {
        if (!isInTap) throw new DOMException("not within a tap", "NotAllowedError");
        return given;
      };
      Object.assign(DeviceOrientationEvent, { requestPermission });
    }, answer);
    await restBetweenFrames(stand.viewer.page);
    await stand.open("&mode=off");
    await stand.viewer.unfold("stereo");
  }
  const tapSplit = () => stand.viewer.page.locator('[data-action="split"]').click();
  const isStereo = async () => (await stand.viewer.snapshot()).isStereo;

  it("splits an iPhone's screen with the first tap", async () => {
    await addIphone("granted");
    await tapSplit();
    await expect.poll(isStereo).toBe(true);
    expect((await notices()).join()).not.toMatch(/not allowed/);
  });

  it("tells the user what to do after an iPhone's refusal", async () => {
    await addIphone("denied");
    await tapSplit();
    await expect
      .poll(notices)
      .toEqual([expect.stringMatching(/not allowed to read.*open the page again, and allow/)]);
    expect(await isStereo()).toBe(false);
    await expect.poll(isFull).toBe(false);
  });

  const PARTS = ["split_session", "interaction"];
  it.each(PARTS)("reports that %s could not be loaded, and releases the screen", async (part) => {
    await stand.viewer.page.route(`**/${part}*`, (route) => route.abort());
    await addIphone("granted");
    await tapSplit();
    await expect.poll(notices).toEqual([expect.stringMatching(/could not be loaded.*tap again/)]);
    expect(await isStereo()).toBe(false);
    await expect.poll(isFull).toBe(false);
  });

  it("ends a headset's session if its code could not be loaded", async () => {
    await stand.viewer.page.route("**/interaction*", (route) => route.abort());
    await addHeadset(stand.viewer.page);
    await stand.open("&mode=off");
    await stand.viewer.page.locator('[data-action="stereo"]').dispatchEvent("click");
    await expect.poll(notices).toEqual([expect.stringMatching(/could not be loaded.*tap again/)]);
    expect(await isStereo()).toBe(false);
    await stand.viewer.page.unroute("**/interaction*");
    await stand.viewer.enterStereo();
  });

  it("splits the screen without WebXR, and Escape goes back", async () => {
    await restBetweenFrames(stand.viewer.page);
    await addClock(stand.viewer.page);
    await stand.viewer.page.addInitScript(() =>
      Object.defineProperty(Navigator.prototype, "wakeLock", { value: undefined }),
    );
    await stand.open("&mode=off");
    await stand.viewer.page.keyboard.press("t");
    await stand.viewer.page.keyboard.press("P");
    await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(true);
    // Each refused feature is reported in stereo, since the page is hidden.
    const { stereoNotices } = await stand.viewer.snapshot();
    expect(stereoNotices.at(-1)).toMatch(/can't keep the screen on/);
    expect(stereoNotices).toEqual(await notices());
    await stand.viewer.page.keyboard.press("j");
    expect((await stand.viewer.snapshot()).stereoNotices.at(-1)).toBe("Choosing by gaze: off");
    await stand.viewer.page.waitForTimeout(1500);
    const { width, height } = { width: 480, height: 270 };
    const half = { y: 0, width: width / 2, height };
    const isDrawn = (pixel: readonly [number, number, number]) => Math.max(...pixel) > 60;
    const lit = [];
    for (const x of [0, width / 2]) {
      const eye = await takePicture(stand.viewer.page, { x, ...half });
      lit.push(eye.count(isDrawn));
    }
    expect(Math.min(...lit)).toBeGreaterThan(100);
    expect(Math.abs(lit[0] - lit[1])).toBeLessThan(0.2 * lit[0]);
    // The surface of the balls, one for each tile, is drawn once for both eyes. The notice about
    // the change has disappeared.
    const noticeCount = async () => (await stand.viewer.snapshot()).stereoNotices.length;
    const draws = [];
    await holdFrames(stand.viewer.page);
    for (let i = 0; i < 2; i++) {
      await stand.viewer.page.keyboard.press("2");
      await tick(stand.viewer.page, 100);
      expect(await noticeCount()).toBeGreaterThan(0);
      for (let k = 0; k < 60 && (await noticeCount()) > 0; k++) await tick(stand.viewer.page, 700);
      expect(await noticeCount()).toBe(0);
      draws.push((await stand.viewer.snapshot()).drawCalls);
    }
    expect(draws[1] - draws[0]).toBe(stand.manifest.tiles.length);
    await stand.viewer.page.keyboard.press("Escape");
    await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(false);
    expect((await stand.viewer.snapshot()).stereoNotices).toEqual([]);
    expect((await state()).selected).not.toBeNull(); // Escape has done nothing else
  });

  it("shows the introduction for 5 s, even at a low frame rate", async () => {
    const { page } = stand.viewer;
    await restBetweenFrames(page);
    await addClock(page);
    await page.addInitScript(() => localStorage.removeItem("stereocell-introductions"));
    await stand.open("&mode=off");
    await page.keyboard.press("t");
    await page.keyboard.press("P");
    await expect
      .poll(async () => (await stand.viewer.snapshot()).stereoNotices.length)
      .toBeGreaterThan(0);
    await holdFrames(page);
    const texts = async () => (await stand.viewer.snapshot()).stereoNotices;
    const before = await texts();
    await tick(page, 700, 8); // 5.6 s: the oldest notice has disappeared, the next one has not
    expect(await texts()).toEqual(before.slice(1));
  });
});
