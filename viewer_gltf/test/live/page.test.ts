/** A source in the page while it is built: the build is paused, continued and completed, and the view never jumps. */
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, it } from "vitest";
import { ViewerPage } from "../support/browser/page";
import { difference, isBackground, takePicture } from "../support/browser/picture";
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
  const source = join(folder, "f.ome.tif");
  const out = join(folder, "out");
  const flags = ["--out", out, "--tile-size", "32,48,72"];
  let server: Awaited<ReturnType<typeof serve>> | undefined;
  let browser: Awaited<ReturnType<typeof openBrowser>>;
  let page: Page;
  let viewer: ViewerPage;

  beforeAll(async () => {
    await askPython("live_source", [source], "");
    const viewport = { width: 700, height: 420 };
    browser = await openBrowser({ viewport, serviceWorkers: "block" });
    page = await browser.context.newPage();
    viewer = new ViewerPage(page);
  });

  /** Opens the page of a build, and pauses it before anything is built. */
  async function begin(): Promise<void> {
    await server?.stop("SIGTERM");
    rmSync(out, { recursive: true, force: true });
    server = await serve(source, flags);
    // The build is paused before the page draws, since a busy machine may draw for longer than this small build takes.
    await page.goto(`${server.address}sw.js`);
    await page.evaluate(
      () =>
        new Promise<void>((resolve) => {
          const socket = new WebSocket(`ws://${location.host}/live`);
          socket.onopen = () => socket.send("pause");
          socket.onmessage = ({ data }) => String(data).includes('"paus') && resolve();
        }),
    );
    await viewer.open(server.address);
  }

  afterAll(async () => {
    await browser?.close();
    await server?.stop("SIGTERM");
    rmSync(folder, { recursive: true, force: true });
  });

  const words = () => page.locator('[data-live="words"]').textContent();
  const press = (command: string) => page.locator(`[data-live="${command}"]`).click();
  const look = async () => {
    const { position, target } = (await viewer.snapshot()).look;
    return [...position, ...target];
  };

  const hasSurface = async () => (await viewer.snapshot()).state.channels[0].hasSurface;

  it("shows coarse volumes at once, and surfaces at the end, and keeps the user's view", async () => {
    await begin();
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

    // The line of the build is as wide as the page, also in a narrow window.
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
    // The new canvas must have the size of the old one, since resizing would clear it.
    const sizes = page.waitForFunction(() => {
      const stages = ["#app.preparing", "#app:not(.preparing)"].map((app) =>
        document.querySelector(`${app}:has(.panel) .stage`),
      );
      const found = stages.map((stage) => [stage?.clientWidth, stage?.clientHeight].join());
      return stages.includes(null) ? null : found;
    });
    const focused = () =>
      page.evaluate(() => (document.activeElement as HTMLElement).dataset.live ?? "");
    await page.locator('[data-live="continue"]').focus();
    await page.keyboard.press("Enter");
    await expect.poll(words).not.toMatch(/^Paus/);
    expect(await focused()).toBe("pause");
    const [newer, older] = (await (await sizes).jsonValue()) ?? [];
    expect(newer).toBe(older);
    await expect.poll(words).toMatch(/^Complete/);
    await expect.poll(hasSurface).toBe(true);
    await viewer.settled();
    const after = await viewer.snapshot();
    expect(after.state.tiles.some(({ isUnfinished }) => isUnfinished)).toBe(false);
    const moved = (await look()).map((part, i) => Math.abs(part - before[i]));
    expect(Math.max(...moved)).toBeLessThan(0.002);
    expect(after.state.channels[0].color[1]).toBeGreaterThan(after.state.channels[0].color[0]);
    expect(await page.locator("#app").count()).toBe(1);
    expect(await page.locator("canvas").count()).toBeLessThanOrEqual(2); // a canvas for the view, and one for the axes
    const last = await takePicture(page);
    const [r, g, b] = last.at(last.width / 2, last.height / 2);
    expect(g).toBeGreaterThan(Math.max(r, b));
    expect(faults).toEqual([]);
    await press("dismiss");
    expect(await page.locator(".build").isVisible()).toBe(false);
  });

  it("opens as a bundle afterwards", async () => {
    await viewer.open(server?.address ?? "");
    expect(await page.locator(".build").count()).toBe(0);
    expect(await hasSurface()).toBe(true);
  });

  it("finds its build finished when it is served again, and keeps its picture after the server has stopped", async () => {
    await server?.stop("SIGTERM");
    server = await serve(source, flags);
    await viewer.open(server.address);
    await expect.poll(hasSurface).toBe(true);
    await viewer.settled();
    await server.stop("SIGTERM");
    const began_ms = performance.now();
    const notices = async () => (await viewer.snapshot()).state.notices.join();
    await expect.poll(notices).toMatch(/^The host does not answer/);
    await viewer.settled();
    // This takes half a second on an idle machine; the connection is abandoned only after 18.5 s.
    expect(performance.now() - began_ms, "ms until nothing is awaited").toBeLessThan(15_000);
    const picture = await takePicture(page);
    expect(isBackground(picture.at(picture.width / 2, picture.height / 2))).toBe(false);
  });
});

describeInChromium("a source of more voxels than a first view has", () => {
  if (!existsSync(STEREOCELL)) {
    it.skip("needs Python");
    return;
  }
  const folder = mkdtempSync(join(tmpdir(), "stereocell-sharp-"));
  let server: Awaited<ReturnType<typeof serve>>;
  let browser: Awaited<ReturnType<typeof openBrowser>>;

  beforeAll(async () => {
    const source = join(folder, "large.ome.tif");
    await askPython("live_source", [source, "6"], "");
    server = await serve(source, ["--no-build", "--tile-size", "96,144,216"]);
    const viewport = { width: 500, height: 320 };
    browser = await openBrowser({ viewport, pixelRatio: 1, serviceWorkers: "block" });
  });

  afterAll(async () => {
    await browser?.close();
    await server?.stop("SIGTERM");
    rmSync(folder, { recursive: true, force: true });
  });

  /** Returns the picture of the first view after everything has loaded. */
  async function see(hasBricks: boolean) {
    const page = await browser.context.newPage();
    const counted = { bricks: 0, files: 0 };
    if (!hasBricks) {
      await page.route("**/manifest.json", async (route) => {
        const response = await route.fetch();
        const { "stereocell-bricks": _, ...headers } = response.headers();
        await route.fulfill({ response, headers });
      });
    }
    page.on("websocket", (socket) =>
      socket.on("framereceived", ({ payload }) => {
        if (typeof payload !== "string" && payload[0] === 2) counted.bricks += payload.length;
      }),
    );
    page.on("request", (request) => {
      if (request.url().includes("/volumes/") && request.headers().range) counted.files++;
    });
    const viewer = new ViewerPage(page);
    await viewer.open(`${server.address}?mode=all&view=front`);
    await viewer.settled();
    const { state, volumes } = await viewer.snapshot();
    const picture = await takePicture(page);
    await page.close();
    return { picture, counted, notices: state.notices, volumes };
  }

  it("shows coarse files first, and then bricks of the source's voxels", async () => {
    const coarse = await see(false);
    const sharp = await see(true);
    for (const { notices, counted, volumes } of [coarse, sharp]) {
      expect(notices).toEqual([]);
      expect(counted.files).toBeGreaterThan(0);
      expect(volumes.map(({ level }) => level)).toEqual([0, 0]);
    }
    expect(coarse.counted.bricks).toBe(0);
    expect(sharp.counted.bricks).toBeGreaterThan(0);
    const apart = difference(sharp.picture, coarse.picture);
    expect(apart, "the same specimen, but for its edges").toBeLessThan(0.15);
    expect(apart, "the source's voxels, and no coarse ones").toBeGreaterThan(0.05);
  });
});
