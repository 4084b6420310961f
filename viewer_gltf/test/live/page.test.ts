/** A source in the page while it is built: paused, continued, seen to complete, without a jump of the view. */
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, it } from "vitest";
import { ViewerPage } from "../support/browser/page";
import { isBackground, takePicture } from "../support/browser/picture";
import { STEREOCELL, serve } from "../support/browser/served";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { askPython } from "../support/python";

describeInChromium("a source that is built behind the page", () => {
  if (!existsSync(STEREOCELL)) {
    it.skip("needs Python");
    return;
  }
  const folder = mkdtempSync(join(tmpdir(), "stereocell-live-"));
  let server: Awaited<ReturnType<typeof serve>>;
  let browser: Awaited<ReturnType<typeof openBrowser>>;
  let page: Page;
  let viewer: ViewerPage;

  beforeAll(async () => {
    const source = join(folder, "f.ome.tif");
    await askPython("live_source", [source], "");
    const out = join(folder, "out");
    server = await serve(source, ["--out", out, "--tile-size", "32,48,72"]);
    const viewport = { width: 700, height: 420 };
    browser = await openBrowser({ viewport, serviceWorkers: "block" });
    page = await browser.context.newPage();
    // before the page draws, which may take a busy machine longer than the build of so small a source
    await page.goto(`${server.address}sw.js`);
    await page.evaluate(
      () =>
        new Promise<void>((resolve) => {
          const socket = new WebSocket(`ws://${location.host}/live`);
          socket.onopen = () => socket.send("pause");
          socket.onmessage = ({ data }) => String(data).includes('"paus') && resolve();
        }),
    );
    viewer = new ViewerPage(page);
    await viewer.open(server.address);
  });

  afterAll(async () => {
    await browser?.close();
    server?.stop("SIGTERM");
    rmSync(folder, { recursive: true, force: true });
  });

  const words = () => page.locator('[data-live="words"]').textContent();
  const press = (command: string) => page.locator(`[data-live="${command}"]`).click();
  const look = async () => {
    const { position, target } = (await viewer.snapshot()).look;
    return [...position, ...target].map((part) => Number(part.toFixed(3)));
  };

  it("shows its coarse volumes at once, and its surfaces at the end, as the user has set the view", async () => {
    const faults: string[] = [];
    page.on("pageerror", ({ message }) => faults.push(message));
    const { state } = await viewer.snapshot();
    expect(state.channels.map(({ hasSurface }) => hasSurface)).toEqual([false]);
    expect(state.tiles.map(({ isUnfinished }) => isUnfinished)).toEqual([true, true]);
    await expect.poll(words).toMatch(/^Paused/);
    await viewer.settled();
    const first = await takePicture(page);
    const middle = first.at(first.width / 2, first.height / 2);
    expect(isBackground(middle), "volumes without a build").toBe(false);

    // the line of the build is as wide as the page, however narrow that is
    const { width, height } = page.viewportSize() as { width: number; height: number };
    await page.setViewportSize({ width: 320, height });
    const widths = () =>
      page.evaluate(() => [
        document.body.scrollWidth,
        document.querySelector(".build")?.scrollWidth,
      ]);
    await expect.poll(widths).toEqual([320, 320]);
    await page.setViewportSize({ width, height });

    await viewer.recolor(state.channels[0].id, "#33cc66");
    await viewer.drag([200, 200], [260, 230]);
    const before = await look();
    await press("continue");
    await expect.poll(words).not.toMatch(/^Paus/);
    await expect.poll(words).toMatch(/^Complete/);
    await expect
      .poll(async () => (await viewer.snapshot()).state.channels[0].hasSurface)
      .toBe(true);
    await viewer.settled();
    const after = await viewer.snapshot();
    expect(after.state.tiles.some(({ isUnfinished }) => isUnfinished)).toBe(false);
    expect(await look()).toEqual(before);
    expect(after.state.channels[0].color[1]).toBeGreaterThan(after.state.channels[0].color[0]);
    expect(await page.locator("#app").count()).toBe(1);
    expect(await page.locator("canvas").count()).toBeLessThanOrEqual(2); // the picture's, and the axes'
    const last = await takePicture(page);
    const [r, g, b] = last.at(last.width / 2, last.height / 2);
    expect(g).toBeGreaterThan(Math.max(r, b));
    expect(faults).toEqual([]);
    await press("dismiss");
    expect(await page.locator(".build").count()).toBe(0);
  });

  it("opens as a bundle afterwards, and its picture outlives the server", async () => {
    await viewer.open(server.address);
    expect(await page.locator(".build").count()).toBe(0);
    expect((await viewer.snapshot()).state.channels[0].hasSurface).toBe(true);
    server.stop("SIGTERM");
    await viewer.settled();
    const picture = await takePicture(page);
    expect(isBackground(picture.at(picture.width / 2, picture.height / 2))).toBe(false);
  });
});
