/** Stereo without WebXR: the two eyes, the lenses, the head, and all ways to leave it. */
import type { Page } from "playwright-core";
import { afterAll, beforeAll, beforeEach, expect, it } from "vitest";
import { bundled } from "../support/browser/bundled";
import type { Browser } from "../support/browser/chromium";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import type { Spot } from "../support/xr/cardboard_harness";

const WIDTH = 844;
const HEIGHT = 390;
const PIXELS_PER_m = 153.3 / 0.0254;
/**
 * Cardboard v1: its field of 40 degrees is smaller than this screen, so both eyes see it in full.
 */
const V1 = { interLens_m: 0.06, screenToLens_m: 0.042, lensHeight_m: 0.032, k: [0.441, 0.156] };
const PIXELS_PER_TANGENT = WIDTH / 2 / (2 * Math.tan((40 * Math.PI) / 180));
const ADDRESS = "http://localhost/split";
const PAGE = `<!doctype html><body style="margin: 0; background: #333">
  <div id="stage" style="width: 200px; height: 100px"></div><button value="v1">start</button>`;

type At = [number, number, number];
type Place = readonly [x_px: number, y_px: number];

describeInChromium("stereo without WebXR", () => {
  let browser: Browser;
  let page: Page;
  let script: string;
  let visits = 0;

  beforeAll(async () => {
    script = await bundled(new URL("../support/xr/cardboard_harness.ts", import.meta.url));
    browser = await openBrowser({ viewport: { width: WIDTH, height: HEIGHT } });
    page = await browser.context.newPage();
    await page.route(`${ADDRESS}*`, (route) =>
      route.fulfill({ body: PAGE, contentType: "text/html" }),
    );
  });

  beforeEach(async () => {
    visits++;
    await page.goto(`${ADDRESS}?${visits}`); // the same address again would keep its history
    await page.addScriptTag({ content: script });
  });

  afterAll(() => browser?.close());

  const start = async (viewer = "v1"): Promise<string> => {
    await page.locator("button").evaluate((button, value) => {
      (button as HTMLButtonElement).value = value;
    }, viewer);
    await page.click("button");
    const result = await page.evaluate(() => window.started);
    if (result !== "started") return result;
    // the canvas is resized after the next layout
    await page.waitForFunction((width) => document.querySelector("canvas")?.width === width, WIDTH);
    return result;
  };
  const status = () => page.evaluate(() => window.stand.status());
  /** Turns the head and rests there, since the turn of a moving head is predicted further. */
  const turnTo = (alpha: number, beta: number, gamma: number) =>
    page.evaluate(
      ([alpha, beta, gamma]) => {
        dispatchEvent(new DeviceOrientationEvent("deviceorientation", { alpha, beta, gamma }));
        return new Promise((resolve) => setTimeout(resolve, 120));
      },
      [alpha, beta, gamma],
    );
  const lookAt = (at: At, radius_m: number): Promise<Spot[]> =>
    page.evaluate(([at, radius]) => window.stand.lookAt(at, radius), [at, radius_m] as const);
  /** Keeps looking there until that is the direction ahead. */
  const rest = async () => {
    for (let k = 0; k < 2; k++) {
      await lookAt([0, 0, -2], 0.04);
      if (k === 0) await page.waitForTimeout(600);
    }
  };
  const lookThroughLens = (at: At, radius_m: number): Promise<Spot[]> =>
    page.evaluate(([at, r]) => window.stand.lookThroughLens(at, r), [at, radius_m] as const);

  const colorsAt = (places: readonly Place[], hasRoom: boolean): Promise<number[][]> =>
    page.evaluate(([at, room]) => window.stand.colorsAt(at, room), [places, hasRoom] as const);

  it("gives a known point the disparity of its distance", async () => {
    expect(await start()).toBe("started");
    const points: At[] = [
      [0, 0, -0.5],
      [0.1, 0.05, -0.4],
      [-0.3, 0.2, -1],
      [0.5, -0.4, -2],
    ];
    for (const at of points) {
      const [left, right] = await lookAt(at, 0.02 * -at[2]);
      expect(left.pixels).toBeGreaterThan(20);
      const disparity = (V1.interLens_m / -at[2]) * PIXELS_PER_TANGENT;
      expect(Math.abs(left.x - right.x - disparity)).toBeLessThan(1);
      expect(Math.abs(left.y - right.y)).toBeLessThan(0.5);
      const middle = WIDTH / 4 + (at[0] / -at[2]) * PIXELS_PER_TANGENT;
      expect(Math.abs((left.x + right.x) / 2 - middle)).toBeLessThan(1);
    }
  });

  it("asks to turn an upright phone, and begins when it lies on its side", async () => {
    const sign = page.getByText("Turn the phone on its side");
    await page.setViewportSize({ width: HEIGHT, height: WIDTH });
    await page.click("button");
    await sign.waitFor();
    expect((await status()).isRunning).toBe(false);
    await page.setViewportSize({ width: WIDTH, height: HEIGHT });
    expect(await page.evaluate(() => window.started)).toBe("started");
    expect((await status()).isRunning).toBe(true);
    expect(await sign.isVisible()).toBe(false);
    await page.setViewportSize({ width: HEIGHT, height: WIDTH });
    await sign.waitFor();
    await page.getByRole("button", { name: "Leave stereo" }).click();
    expect((await status()).isRunning).toBe(false);
    expect(await sign.count()).toBe(0);
    await page.setViewportSize({ width: WIDTH, height: HEIGHT });
  });

  it("shows a point on a lens's axis at the lens's centre", async () => {
    await start();
    for (const [eye, sign] of [
      [0, -1],
      [1, 1],
    ]) {
      const spot = (await lookThroughLens([(sign * V1.interLens_m) / 2, 0, -5], 0.05))[eye];
      const x = WIDTH / 2 + (sign * V1.interLens_m * PIXELS_PER_m) / 2;
      expect(Math.abs(spot.x - x)).toBeLessThan(1);
      expect(Math.abs(spot.y - V1.lensHeight_m * PIXELS_PER_m)).toBeLessThan(1);
    }
  });

  it("shows a point beside the axis where the lens makes it straight", async () => {
    await start();
    for (const [x, y] of [
      [0.5, 0],
      [-0.4, 0.3],
      [0, -0.6],
      [0.45, -0.5],
    ]) {
      // r at which r (1 + k1 r^2 + k2 r^4) equals the tangent, by Newton's method
      const seen = Math.hypot(x, y);
      let r = seen;
      for (let i = 0; i < 20; i++) {
        const [k1, k2] = V1.k;
        const f = r + k1 * r ** 3 + k2 * r ** 5 - seen;
        r -= f / (1 + 3 * k1 * r ** 2 + 5 * k2 * r ** 4);
      }
      const shown = (r / seen) * V1.screenToLens_m * PIXELS_PER_m;
      const [left] = await lookThroughLens([-V1.interLens_m / 2 + 5 * x, 5 * y, -5], 0.08);
      const centre_x = WIDTH / 2 - (V1.interLens_m * PIXELS_PER_m) / 2;
      expect(Math.abs(left.x - centre_x - x * shown)).toBeLessThan(1);
      expect(Math.abs(left.y - V1.lensHeight_m * PIXELS_PER_m - y * shown)).toBeLessThan(1);
    }
  });

  it("shows the same colours as the page", async () => {
    await start();
    const lens: Place = [240, 193];
    const [color] = await colorsAt([lens], false);
    [0x12, 0x34, 0x56].forEach((v, i) => {
      expect(Math.abs(color[i] - v)).toBeLessThanOrEqual(1);
    });
  });

  it("is black outside the lenses, and has a line to align the phone", async () => {
    await start();
    const corners: Place[] = [
      [0, 0],
      [WIDTH - 1, 0],
      [0, HEIGHT - 1],
      [WIDTH / 2, HEIGHT - 1],
    ];
    for (const color of await colorsAt(corners, true)) expect(color).toEqual([0, 0, 0, 255]);
    const [line, above] = await colorsAt(
      [
        [WIDTH / 2, 10],
        [WIDTH / 2, 80],
      ],
      true,
    );
    expect(line).toEqual([0x60, 0x60, 0x60, 255]);
    expect(above).toEqual([0, 0, 0, 255]);
  });

  it("follows the head", async () => {
    await start();
    const at: At = [0, 0, -2];
    await turnTo(0, 90, 0);
    await rest();
    const [ahead] = await lookAt(at, 0.04);

    // Twenty degrees to the left about the neck, 8 cm behind the eyes: the mark moves to the right.
    await turnTo(20, 90, 0);
    const [left, right] = await lookAt(at, 0.04);
    const turn = (20 * Math.PI) / 180;
    const [x, z] = [0.08 * Math.sin(turn), 2 + 0.08 - 0.08 * Math.cos(turn)];
    const across = x * Math.cos(turn) + z * Math.sin(turn);
    const away = z * Math.cos(turn) - x * Math.sin(turn);
    const middle = WIDTH / 4 + (across / away) * PIXELS_PER_TANGENT;
    expect(Math.abs((left.x + right.x) / 2 - middle)).toBeLessThan(1);

    await turnTo(0, 100, 0); // tilted up
    const [below] = await lookAt(at, 0.04);
    expect(below.y).toBeLessThan(ahead.y - 20);
    expect(Math.abs(below.x - ahead.x)).toBeLessThan(1);

    // The head tilts to its right shoulder, so the image rotates to the left.
    await turnTo(270, 80, 90);
    const [rolled] = await lookAt([0, 0.5, -2], 0.04);
    expect(rolled.x).toBeLessThan(ahead.x - 5);
  });

  it("takes the direction ahead from the resting head, not from the hands that held the phone", async () => {
    await start();
    const middle = async () => {
      const [left, right] = await lookAt([0, 0, -2], 0.04);
      return (left.x + right.x) / 2 - WIDTH / 4;
    };
    await turnTo(40, 90, 0); // in landscape and level, in a hand
    expect(Math.abs(await middle())).toBeLessThan(1);
    await turnTo(137, 90, 0);
    await rest();
    expect(Math.abs(await middle())).toBeLessThan(1);
    await turnTo(127, 90, 0);
    expect(await middle()).toBeLessThan(-20);
    await turnTo(137, 90, 0);
    expect(Math.abs(await middle())).toBeLessThan(1);
  });

  it("reports that the orientation was refused, and restores the page", async () => {
    await page.evaluate(() => {
      Object.assign(DeviceOrientationEvent, { requestPermission: async () => "denied" });
    });
    expect(await start()).toMatch(/not allowed to read how the phone is turned.*open the page/);
    const { isRunning, log } = await status();
    expect(isRunning).toBe(false);
    expect(log).toEqual([]);
    await page.waitForFunction(() => document.fullscreenElement === null);
    expect(await page.locator("#stage").evaluate(({ clientWidth }) => clientWidth)).toBe(200);
  });

  it("asks for the orientation once, within the tap", async () => {
    await page.evaluate(() => {
      const asked: boolean[] = [];
      const requestPermission = async () => {
        asked.push(navigator.userActivation.isActive);
        return "granted";
      };
      Object.assign(window, { asked });
      Object.assign(DeviceOrientationEvent, { requestPermission });
    });
    expect(await start()).toBe("started");
    expect(await page.evaluate(() => (window as unknown as { asked: boolean[] }).asked)).toEqual([
      true,
    ]);
  });

  it("reports features that this browser lacks, and continues without them", async () => {
    await page.evaluate(() => {
      Object.assign(HTMLElement.prototype, {
        requestFullscreen: undefined,
        webkitRequestFullscreen: undefined,
      });
      Object.defineProperty(navigator, "wakeLock", { value: undefined });
      Object.defineProperty(window, "DeviceOrientationEvent", { value: undefined });
    });
    expect(await start()).toBe("started");
    const { isRunning, problems } = await status();
    expect(isRunning).toBe(true);
    expect(problems.join(" ")).toMatch(/home screen.*dim.*can't follow your head/);
    // The canvas covers the page even without full screen.
    expect(await page.locator("#stage").evaluate(({ clientWidth }) => clientWidth)).toBe(WIDTH);
  });

  it("takes a tap as a button press when the finger is lifted", async () => {
    await start();
    await page.mouse.move(500, 100);
    await page.mouse.down();
    expect((await status()).log).toEqual(["start", "press"]);
    await page.mouse.up();
    expect((await status()).log).toEqual(["start", "press", "tap", "release"]);
  });

  it("does not take a drag for a tap", async () => {
    await start();
    await page.mouse.move(500, 100);
    await page.mouse.down();
    await page.mouse.move(560, 100);
    await page.mouse.up();
    expect((await status()).log).toEqual(["start", "press", "release", "drag"]);
  });

  it.each([
    ["Escape", () => page.keyboard.press("Escape")],
    ["the back gesture", () => page.evaluate(() => history.back())],
    ["leaving full screen", () => page.evaluate(() => document.exitFullscreen())],
    ["the page itself", () => page.evaluate(() => window.stand.end())],
  ])("is ended once by %s, on the same page", async (_, leave) => {
    await start();
    expect(await page.evaluate(() => document.fullscreenElement?.id)).toBe("stage");
    await leave();
    await page.waitForFunction(() => !window.stand.status().isRunning);
    await page.waitForFunction(() => document.fullscreenElement === null);
    await page.waitForFunction(() => history.state === null);
    expect((await status()).log).toEqual(["start", "end"]);
    expect(page.url()).toBe(`${ADDRESS}?${visits}`);
    expect(await page.locator("#stage").evaluate(({ clientWidth }) => clientWidth)).toBe(200);
  });

  it("goes one step back, even if the page was reloaded in a session", async () => {
    await start();
    await page.reload();
    await page.addScriptTag({ content: script });
    await start();
    await page.evaluate(() => history.back());
    await page.waitForFunction(() => !window.stand.status().isRunning);
    await page.waitForTimeout(300);
    expect((await status()).log).toEqual(["start", "end"]); // the same page, not an older one
  });

  it("uses no more GPU resources the tenth time than the second", async () => {
    const counts: number[] = [];
    for (let i = 0; i < 10; i++) {
      expect(await start(i % 2 === 0 ? "v1" : "v2")).toBe("started");
      await lookThroughLens([0, 0, -2], 0.04);
      const { geometries, textures } = await status();
      counts.push(geometries + textures);
      await page.evaluate(() => window.stand.end());
      await page.waitForFunction(() => history.state === null);
    }
    expect(counts[9]).toBe(counts[1]);
  });
});
