import { afterAll, beforeAll, beforeEach, describe, expect, inject, test } from "vitest";
import { type Browser, hasChromium } from "../support/browser/chromium";
import { openBrowser } from "../support/browser/shared_browser";
import { FrontEnd } from "../support/notebook/front_end";
import { Kernel } from "../support/notebook/kernel";
import { hasPython } from "../support/python";

type View = Readonly<{ eye_um: number[]; target_um: number[] }>;
type Picked = Readonly<{ point_um: number[]; tile: string; channel: string; object: null }>;
type Appearance = Readonly<{ visible: boolean; color: string; opacity: number; window: number[] }>;

/** Policy that VS Code sends with its outputs if configured: code from blob: is forbidden. */
const STRICT =
  "default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; " +
  "img-src https: http: data:; connect-src https:; child-src https: data:";

describe.skipIf(!hasChromium() || !hasPython)("the widget in a notebook", () => {
  let kernel: Kernel;
  let browser: Browser;

  beforeAll(async () => {
    browser = await openBrowser({ viewport: { width: 640, height: 300 } });
  });
  beforeEach(() => {
    kernel?.stop();
    kernel = new Kernel(inject("fixture"));
    kernel.run("viewer.link = '#v=1&quality=low'"); // software draws it
  });
  afterAll(async () => {
    kernel?.stop();
    await browser.close();
  });

  const open = async (surroundings = {}) =>
    FrontEnd.open(await browser.context.newPage(), kernel, surroundings);
  const channels = () => kernel.ask<Record<string, Appearance>>("viewer.channels");
  const inPython = (expression: string) => expect.poll(() => kernel.ask(expression));

  /** Returns the number of messages in a time, in both directions. */
  const heardIn = (duration_ms: number) => async () => {
    const before = kernel.messageCount;
    await new Promise((resolve) => setTimeout(resolve, duration_ms));
    return kernel.messageCount - before;
  };
  /** Moves the eye, and waits until the page has moved it and no more messages pass. */
  const moveTo = async (eye_um: string, target_um: string) => {
    kernel.run(`viewer.view = {'eye_um': ${eye_um}, 'target_um': ${target_um}}`);
    await inPython("'eye=' in viewer.link").toBe(true);
    await expect.poll(heardIn(1000)).toBe(0);
  };

  test("the page opens without a server, and both sides have its state", async () => {
    const front = await open();
    const frame = await front.viewer();
    // no request went to any host, except for the page of the test itself
    const own = ["/cell.html", "/cell.css", "/listen.js", "/widget.js", "/favicon.ico"];
    expect(front.requests.filter((path) => !own.includes(path))).toEqual([]);
    await inPython("len(viewer.channels) > 0 and viewer.link.startswith('#v=1')").toBe(true);

    // from the page to Python
    const [first, second] = Object.keys(await channels());
    await frame.locator(`[data-channel="${first}"] [data-part="shown"]`).setChecked(false);
    await inPython(`viewer.channels["${first}"]["visible"]`).toBe(false);

    // from Python to the page, which reports the resulting values
    kernel.run(`viewer.set_channel("${first}", visible=True, color="#00ff00", opacity=0.25)`);
    kernel.run(`viewer.set_channel("${second}", window=(-1e9, 1e9))`);
    const state = () => frame.evaluate(() => window.stereocell?.snapshot().state.channels ?? []);
    await expect
      .poll(async () => (await state())[0])
      .toMatchObject({ shown: true, color: [0, 1, 0], opacity: 0.25 });
    await inPython(`viewer.channels["${second}"]["window"][0] > -1e9`).toBe(true);

    await moveTo("(30, 40, 50)", "(4, -4, 2)");
    await inPython("viewer.view['eye_um']").toEqual([30, 40, 50]);
    const link = await kernel.ask<string>("viewer.link");

    // a link contains the whole view
    kernel.run("viewer.link = '#v=1&quality=low'");
    const value = (name: string) => `viewer.channels.get("${first}", {}).get("${name}")`;
    await inPython(value("opacity")).toBe(1);
    await inPython("viewer.view.get('eye_um', [30, 40, 50]) == [30, 40, 50]").toBe(false);
    kernel.run(`viewer.link = "${link}"`);
    await inPython("viewer.view.get('eye_um')").toEqual([30, 40, 50]);
    await inPython(value("color")).toBe("#00ff00");

    // at rest no messages pass
    await inPython("len(viewer._picture) > 100").toBe(true);
    await expect.poll(heardIn(2000)).toBe(0);
    await front.stop();
  });

  test("in the frame of another host, as in Colab and VS Code, a tap is reported and a pick is marked", async () => {
    const front = await open({ isForeign: true });
    const frame = await front.viewer();
    // straight towards the large ball, of radius 9
    await inPython("len(viewer.channels) > 0").toBe(true);
    await moveTo("(48, -24, 70)", "(48, -24, 12)");
    const canvas = frame.locator(".stage canvas").first();
    const box = await canvas.boundingBox();
    if (box === null) throw new Error("no canvas");
    await canvas.click({ position: { x: box.width / 2, y: box.height / 2 } });
    await inPython("viewer.picked is not None").toBe(true);
    const picked = await kernel.ask<Picked>("viewer.picked");
    expect(picked.channel).toBe("Balls");
    expect(picked.object).toBeNull();
    for (const [i, at] of [48, -24, 21].entries()) {
      expect(Math.abs(picked.point_um[i] - at)).toBeLessThan(1);
    }
    const { state } = await frame.evaluate(() => {
      const snapshot = window.stereocell?.snapshot();
      if (snapshot === undefined) throw new Error("no viewer");
      return snapshot;
    });
    expect(state.tiles.map(({ id }) => id)).toContain(picked.tile);
    kernel.run("viewer.picked = {'point_um': (1, -2, 1)}");
    const measured = () => frame.evaluate(() => window.stereocell?.snapshot().state.measured);
    await expect.poll(measured).toEqual([[1, -2, 1]]);
    kernel.run("viewer.picked = None");
    await expect.poll(measured).toEqual([]);
    await front.stop();
  });

  test("a view that is shown again is unchanged, and requests no file twice", async () => {
    const front = await open();
    await front.viewer();
    await moveTo("(30, 40, 50)", "(4, -4, 2)");
    const asked = () => kernel.received.filter((text) => text.includes('"ask":"')).length;
    await inPython("len(viewer._picture) > 100").toBe(true);
    const before = asked();
    // the output with the image is shown while the viewer is not
    const below = front.cell.locator("#below");
    expect(await below.isVisible()).toBe(false);
    await front.leave();
    expect(await below.isVisible()).toBe(true);
    await front.show();
    const frame = await front.viewer();
    const view = await kernel.ask<View>("viewer.view");
    expect(view.eye_um).toEqual([30, 40, 50]);
    const look = await frame.evaluate(() => window.stereocell?.snapshot().look);
    expect(look).toBeDefined();
    // images may be sent, but no files
    const files = kernel.received.slice(before).filter((text) => /"ask":"(file|page)"/.test(text));
    expect(new Set(files).size).toBe(files.length);
    await front.stop();
  });

  const REAL = process.env.STEREOCELL_REAL_BUNDLE;
  test.skipIf(REAL === undefined)(
    "textures, and light from files of the page, are loaded too",
    async () => {
      kernel.stop();
      kernel = new Kernel(REAL ?? "");
      const front = await open();
      const faults: string[] = [];
      front.page.on("pageerror", ({ message }) => faults.push(message));
      const frame = await front.viewer();
      kernel.run("viewer.link = '#v=1&quality=low&mode=traced'");
      const state = () => frame.evaluate(() => window.stereocell?.snapshot().state);
      await expect.poll(async () => (await state())?.mode).toBe("traced");
      await expect
        .poll(() => kernel.received.some((text) => text.includes("environments/")))
        .toBe(true);
      await frame.evaluate(() => window.stereocell?.settled());
      expect((await state())?.notices).toEqual([]);
      expect(faults).toEqual([]);
      await front.stop();
    },
  );

  test("if the page may not run, its image is shown with the reason", async () => {
    const front = await open({ headers: { "Content-Security-Policy": STRICT } });
    await front.cell.waitForFunction(() =>
      document.querySelector(".stereocell p")?.textContent?.startsWith("The viewer can't run here"),
    );
    await front.stop();
  });

  test("a still image is shown until the kernel answers", async () => {
    const png =
      "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";
    kernel.run(`import base64, time; viewer._picture = base64.b64decode("${png}")`);
    await kernel.ask("1");
    kernel.run("import time; time.sleep(3)");
    const front = await open();
    const picture = front.cell.locator(".stereocell img");
    expect(await picture.getAttribute("src")).toBe(`data:image/png;base64,${png}`);
    // the browser hardly draws a page that is fully covered: the viewer took ten seconds longer to
    // load
    const opacity = await picture.evaluate((each) => Number(getComputedStyle(each).opacity));
    expect(opacity).toBeLessThan(1);
    expect(await front.cell.locator(".stereocell p").textContent()).toContain(
      "when no cell is running",
    );
    await front.viewer();
    await front.stop();
  });
});
