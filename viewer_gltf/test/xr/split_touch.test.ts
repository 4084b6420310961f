/**
 * Fingers on the split screen: one turns, two bring nearer, a tap chooses, and a press chooses
 * nothing.
 */
import { expect, it } from "vitest";
import { difference, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SIZE = { width: 640, height: 300 };
type Finger = Readonly<{ x: number; y: number; id: number }>;

describeInChromium("a phone with a notch in a Cardboard", () => {
  const stand = prepareStand({ viewport: SIZE, hasTouch: true, hasRests: true });

  it("gives both eyes equal parts around the middle of the screen", async () => {
    await stand.open("&mode=off");
    const { page } = stand.viewer;
    const devtools = await page.context().newCDPSession(page);
    const insets = { left: 44, leftMax: 44 };
    await devtools.send("Emulation.setSafeAreaInsetsOverride", { insets });
    await page.locator('[data-overlay="stereo"]').tap();
    await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(true);
    const canvas = await page.locator(".stage canvas").boundingBox();
    expect(canvas).toMatchObject({ x: 44, width: SIZE.width - 88, height: SIZE.height });
  });
});

describeInChromium("fingers in a Cardboard", () => {
  const stand = prepareStand({ viewport: SIZE, hasTouch: true, hasRests: true });

  it("turn, bring nearer and choose, without choosing anything on the way", async () => {
    await stand.open("&mode=off");
    const { page } = stand.viewer;
    await page.keyboard.press("j"); // choosing by gaze off
    await page.locator('[data-overlay="stereo"]').tap(); // on the canvas: a phone has no headset
    await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(true);
    const announced = async () => (await stand.viewer.snapshot()).stereoNotices.length;
    await expect.poll(announced).toBe(0);
    const chosen = async () => {
      const { selected, isolated } = (await stand.viewer.snapshot()).state;
      return [selected, isolated];
    };
    const devtools = await page.context().newCDPSession(page);
    const touch = async (type: "touchStart" | "touchMove" | "touchEnd", touchPoints: Finger[]) => {
      await devtools.send("Input.dispatchTouchEvent", { type, touchPoints });
      await page.waitForTimeout(150); // a few frames
    };
    // above the horizon, since bar and ground stay in place
    const leftEye = () => takePicture(page, { x: 0, y: 0, width: SIZE.width / 2, height: 146 });
    const drawn = async () => (await leftEye()).count((pixel) => Math.max(...pixel) > 110);
    const finger = (x: number, y = 150, id = 1): Finger => ({ x, y, id });

    const before = await leftEye();
    await touch("touchStart", [finger(300)]);
    expect(await chosen()).toEqual([null, null]);
    for (const x of [320, 345, 370]) await touch("touchMove", [finger(x)]);
    await touch("touchEnd", []);
    expect(await chosen()).toEqual([null, null]);
    expect(difference(before, await leftEye())).toBeGreaterThan(0.02);
    for (const x of [370, 345, 320, 300]) {
      await touch(x === 370 ? "touchStart" : "touchMove", [finger(x)]);
    }
    await touch("touchEnd", []);
    expect(difference(before, await leftEye())).toBeLessThan(0.01); // moved back the same way

    const far = await drawn();
    await touch("touchStart", [finger(280)]);
    await touch("touchStart", [finger(280), finger(360, 150, 2)]);
    await touch("touchMove", [finger(260), finger(380, 150, 2)]);
    await touch("touchEnd", []);
    expect(await drawn()).toBeGreaterThan(1.15 * far);
    expect(await chosen()).toEqual([null, null]);

    await touch("touchStart", [finger(300)]);
    expect(await chosen()).toEqual([null, null]);
    await touch("touchEnd", []);
    await expect.poll(async () => (await chosen())[0]).not.toBeNull();
    for (const type of ["touchStart", "touchMove"] as const) {
      await touch(type, [finger(type === "touchStart" ? 300 : 360)]);
    }
    await touch("touchEnd", []);
    expect((await chosen())[1]).toBeNull(); // a drag over a selected tile does not isolate it

    // while held, the specimen follows the head, and comes nearer when the head tilts down
    const turnHead = async (alpha: number, beta: number) => {
      await page.evaluate(
        ([alpha, beta]) =>
          void dispatchEvent(
            new DeviceOrientationEvent("deviceorientation", { alpha, beta, gamma: 0 }),
          ),
        [alpha, beta],
      );
      await page.waitForTimeout(400);
    };
    await turnHead(0, 90);
    await page.waitForTimeout(600); // the head has rested, so this is the direction ahead
    const still = await leftEye();
    await turnHead(25, 90);
    expect(difference(still, await leftEye())).toBeGreaterThan(0.05); // only the head looks aside
    await turnHead(0, 90);
    const [size, selected] = [await drawn(), await chosen()];
    await touch("touchStart", [finger(300)]);
    await page.waitForTimeout(2500);
    await turnHead(25, 90);
    expect(difference(still, await leftEye())).toBeLessThan(0.04);
    await turnHead(25, 80);
    await expect.poll(drawn).toBeGreaterThan(1.2 * size);
    await touch("touchEnd", []);
    expect(await chosen()).toEqual(selected); // the release was not a tap
    const held = await leftEye();
    await turnHead(0, 90);
    expect(difference(held, await leftEye())).toBeGreaterThan(0.05); // the released specimen stays
  });
});
