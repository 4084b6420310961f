/** A page that *Preview* has opened follows a build that is started on the page of the inbox. */
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, it } from "vitest";
import { ViewerPage } from "../support/browser/page";
import { STEREOCELL, serve } from "../support/browser/served";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { drop } from "../support/inbox/drop";
import { askPython } from "../support/python";

describeInChromium("an image that is previewed before it is built", () => {
  if (!existsSync(STEREOCELL)) {
    it.skip("needs Python");
    return;
  }
  let folder: string;
  let server: Awaited<ReturnType<typeof serve>> | undefined;
  let browser: Awaited<ReturnType<typeof openBrowser>>;
  let page: Page;
  const faults: string[] = [];

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-item-"));
    await askPython("live_source", [join(folder, "f.ome.tif")], "");
    const viewport = { width: 500, height: 360 };
    browser = await openBrowser({ viewport, serviceWorkers: "block" });
    page = await browser.context.newPage();
    page.on("pageerror", ({ message }) => faults.push(message));
  });

  /** Opens the page of an empty inbox. */
  async function begin(): Promise<void> {
    await server?.stop("SIGTERM");
    server = await serve(`--inbox=${await mkdtemp(join(folder, "box-"))}`);
    await page.goto(server.address);
    await page.getByText("There are no images yet").waitFor();
    faults.length = 0;
  }

  afterAll(async () => {
    await browser?.close();
    await server?.stop("SIGTERM");
    await rm(folder, { recursive: true, force: true, maxRetries: 5 });
  });

  const card = () => page.locator("article").first();
  const state = () => card().locator("[data-state]").textContent();

  it("receives surfaces and bundle without a reload, and controls the build", async () => {
    await begin();
    await drop(page, join(folder, "f.ome.tif"));
    await expect.poll(state).toBe("Ready");
    const [tab] = await Promise.all([
      page.waitForEvent("popup"),
      card().locator('[data-action="look"]').click(),
    ]);
    tab.on("pageerror", ({ message }) => faults.push(message));
    await tab.waitForFunction(() => window.stereocell !== undefined);
    await tab.evaluate(() => window.stereocell?.ready);
    const viewer = new ViewerPage(tab);
    const hasSurface = async () => (await viewer.snapshot()).state.channels[0].hasSurface;
    const words = () => tab.locator('[data-live="words"]').textContent();
    expect(await hasSurface()).toBe(false);
    expect(await tab.locator(".build").count()).toBe(0); // no build was requested

    await card().locator('[data-action="build"]').click();
    await tab.locator('[data-live="pause"]').click();
    await expect.poll(state).toBe("Paused");
    await expect.poll(words).toMatch(/^Paused/);
    await tab.locator('[data-live="cancel"]').click();
    await expect.poll(state).toBe("Cancelled");
    await tab.locator('[data-live="continue"]').click();
    await expect.poll(words).toMatch(/^Complete/);
    await expect.poll(state).toBe("Built");
    await expect.poll(hasSurface).toBe(true);

    await tab.locator('[data-live="dismiss"]').click();
    expect(await tab.locator(".build").count()).toBe(0);
    expect(faults).toEqual([]);
  });
});
