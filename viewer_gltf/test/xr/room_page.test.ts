/**
 * The specimen in the user's own room (immersive-ar): nothing behind it, on a table, usable by
 * taps.
 */
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";

const SHOTS = process.env.STEREOCELL_SHOTS;
/** Metres; height of the emulated eyes. */
const EYES_M = 1.6;

/**
 * Adds a device before the page's scripts: a headset whose cameras show the room, or a phone held
 * in a hand.
 */
async function addDevice(page: Page, isPhone: boolean, hasFloor = true): Promise<void> {
  const script = new URL(import.meta.resolve("iwer/build/iwer.min.js"));
  await page.addInitScript(await readFile(script, "utf8"));
  await page.addInitScript(
    ([isPhone, hasFloor, eyes_m]) => {
      const { IWER } = window as unknown as { IWER: typeof import("iwer") };
      const features = IWER.metaQuest3.supportedFeatures.filter(
        (name) => hasFloor || !name.endsWith("-floor"),
      );
      const config = {
        ...IWER.metaQuest3,
        supportedFeatures: features,
        ...(isPhone ? { interactionMode: "screen-space" as XRInteractionMode } : {}),
      };
      const device = new IWER.XRDevice(config as typeof IWER.metaQuest3, {
        stereoEnabled: !isPhone,
      });
      device.installRuntime({ forceInstall: true });
      device.position.set(0.5, eyes_m, 0.3);
      // 90 degrees to the left, and down to the table
      device.quaternion.set(-0.2391, 0.6634, 0.2415, 0.6656);
      Object.assign(window, { headset: device });
      document.addEventListener("DOMContentLoaded", () => {
        const sheet = new CSSStyleSheet();
        sheet.replaceSync(
          "[data-webxr_runtime] canvas { width: 100% !important; height: 100% !important; }" +
            // stands for the image of the cameras
            "body { background: repeating-linear-gradient(45deg, #385, #385 20px, #583 20px, #583 40px); }",
        );
        document.adoptedStyleSheets.push(sheet);
      });
    },
    [isPhone, hasFloor, EYES_M] as const,
  );
}

describeInChromium("the specimen in the user's room", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 320 } });
  const page = () => stand.viewer.page;

  async function enter(query: string, isPhone: boolean, hasFloor = true): Promise<void> {
    await addDevice(page(), isPhone, hasFloor);
    await stand.open(query);
    await page().locator('[data-overlay="room"]').click();
    await page().waitForFunction(() => window.stereocell?.snapshot().isStereo);
    await stand.viewer.settled();
    const frames = await page().evaluate(() => window.stereocell?.frames ?? 0);
    await page().waitForFunction((n) => (window.stereocell?.frames ?? 0) > n + 3, frames);
  }

  /**
   * Shares of the canvas's pixels, right after a frame, that are clear, opaque, or lighter than
   * their opacity.
   */
  const coverage = () =>
    page().evaluate(async () => {
      const canvas = document.querySelector("canvas");
      const gl = canvas?.getContext("webgl2");
      if (!canvas || !gl) throw new Error("no picture");
      const { headset } = window as unknown as { headset: import("iwer").XRDevice };
      const session = headset.activeSession;
      if (session === undefined) throw new Error("no session");
      await new Promise<void>((resolve) => session.requestAnimationFrame(() => resolve()));
      const { drawingBufferWidth: w, drawingBufferHeight: h } = gl;
      const data = new Uint8Array(4 * w * h);
      gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, data);
      let [clear, opaque, glowing] = [0, 0, 0];
      for (let i = 0; i < data.length; i += 4) {
        const [r, g, b, a] = data.subarray(i, i + 4);
        if (a === 0) clear++;
        if (a === 255) opaque++;
        if (Math.max(r, g, b) > a + 2) glowing++; // light without opacity is an error
      }
      return [clear, opaque, glowing].map((count) => count / (w * h));
    });

  const drawn = [
    ["surfaces", "&mode=off"],
    ["volumes", "&mode=all"],
    ["the disc", "&mode=disc&switch=9"],
    ["traced paths", "&mode=traced"],
  ] as const;
  it.each(sweep(drawn, ([what]) => what === "volumes"))(
    "has nothing behind it: %s",
    async (what, query) => {
      await enter(query, false);
      await expect.poll(async () => (await coverage())[0]).toBeGreaterThan(0.5);
      const [clear, opaque, glowing] = await coverage();
      expect(clear).toBeLessThan(0.995);
      if (what === "surfaces") expect(opaque).toBeGreaterThan(0.005);
      expect(glowing).toBeLessThan(0.002);
      if (SHOTS) await page().screenshot({ path: join(SHOTS, `room_${what}.png`) });
    },
  );

  it.each(sweep([true, false], (isKnown) => !isKnown))(
    "stands ahead at the height of a table: floor known %s",
    async (floor) => {
      await enter("&mode=off", false, floor);
      const at = await page().evaluate(() => window.stereocell?.snapshot().specimenAt);
      if (at === undefined) throw new Error("no place");
      expect(at[0]).toBeCloseTo(0.5 - 0.9, 1); // the head looks along -x
      expect(at[2]).toBeCloseTo(0.3, 1);
      expect(at[1]).toBeCloseTo(floor ? 0.95 : -0.5, 2);
    },
  );

  it.each([
    ["a headset's bar and panel above it, within reach", false],
    ["a phone's panel in front of it, within the image, and the bar at its foot", true],
  ])("has %s", async (_, isPhone) => {
    await enter("&mode=off", isPhone);
    const angles = async () => (await stand.viewer.snapshot()).menu.map(({ up_deg }) => up_deg);
    const closed = await angles();
    expect(closed.length).toBeGreaterThan(4);
    await page().keyboard.press("h");
    const ids = async () => (await stand.viewer.snapshot()).menu.map(({ id }) => id);
    await expect.poll(ids).toContain("close");
    if (SHOTS) await page().screenshot({ path: join(SHOTS, `room_panel_${isPhone}.png`) });
    const opened = await angles();
    expect(opened.length).toBeGreaterThan(6);
    // its middle is 0.65 m below the eyes and 0.9 m ahead, 36 degrees down, and it is 0.48 m long
    for (const up_deg of [closed, opened]) {
      const [lowest, highest] = [Math.min(...up_deg), Math.max(...up_deg)];
      if (isPhone) {
        expect(highest).toBeLessThan(-15);
        expect(lowest).toBeGreaterThan(-62);
      } else {
        expect(lowest).toBeGreaterThan(-16);
        expect(highest).toBeLessThan(35);
      }
    }
    if (isPhone) expect(Math.max(...closed)).toBeLessThan(-54); // below its lower edge
  });

  it("is one image on a phone, and a key leaves it again", async () => {
    await enter("&mode=off", true);
    if (SHOTS) await page().screenshot({ path: join(SHOTS, "room_phone.png") });
    const [clear] = await coverage();
    expect(clear).toBeGreaterThan(0.5);
    expect(clear).toBeLessThan(0.995);
    await page().keyboard.press("Home"); // leaves it again
    await page().waitForFunction(() => window.stereocell?.snapshot().isStereo === false);
    await stand.viewer.still();
    expect(await page().locator('[data-overlay="room"]').isVisible()).toBe(true);
  });
});
