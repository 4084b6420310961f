/** The inbox with its server: a real MRI is uploaded despite faults, previewed and deleted. */
import { existsSync } from "node:fs";
import { mkdtemp, readdir, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { ViewerPage } from "../support/browser/page";
import { STEREOCELL, serve } from "../support/browser/served";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { drop } from "../support/inbox/drop";

/** A real volume, where it is available. */
const DATA = process.env.STEREOCELL_DATA;
const MRI = join(DATA ?? "", "mri_t1_7t/dicoms");
const IS_AVAILABLE = DATA !== undefined && existsSync(MRI) && existsSync(STEREOCELL);

describe.skipIf(!IS_AVAILABLE)("with its server", () => {
  describeInChromium("the inbox", () => {
    let folder: string;
    let server: Awaited<ReturnType<typeof serve>>;
    let browser: Awaited<ReturnType<typeof openBrowser>>;
    let page: Page;
    const faults: string[] = [];

    beforeAll(async () => {
      folder = await mkdtemp(join(tmpdir(), "stereocell-inbox-"));
      server = await serve(`--inbox=${folder}`);
      browser = await openBrowser({ viewport: { width: 900, height: 600 }, isBlind: true });
      page = await browser.context.newPage();
      page.on("dialog", (dialog) => void dialog.accept()); // leaving the page ends an upload
      page.on("pageerror", ({ message }) => faults.push(message));
      await page.goto(server.address);
      await page.getByText("There are no images yet").waitFor();
    });

    afterAll(async () => {
      await browser?.close();
      await server?.stop("SIGTERM");
      await rm(folder, { recursive: true, force: true, maxRetries: 5 });
    });

    const card = () => page.locator("article").first();
    const words = () => card().locator("[data-words]").textContent();
    const state = () => card().locator("[data-state]").textContent();
    const shareOf = async () => Number(await card().locator("progress").getAttribute("value"));

    it("uploads a real MRI despite two interruptions, recognises it, previews it and deletes it", async () => {
      await drop(page, MRI);
      await expect.poll(shareOf).toBeGreaterThan(0.1);
      await browser.context.setOffline(true);
      await expect.poll(words).toMatch(/^The connection is lost/);
      await browser.context.setOffline(false);
      await expect.poll(shareOf).toBeGreaterThan(0.4);
      await page.reload();
      await expect.poll(words).toMatch(/Drop the same files again to continue/);
      expect(await shareOf()).toBeLessThan(1);
      await drop(page, MRI);
      await expect.poll(state).toBe("Ready");
      expect(await page.locator("article").count()).toBe(1);
      const facts = await card().locator("dd").allTextContents();
      expect(facts.slice(0, 3)).toEqual(["DICOM, MR", "19.2 × 25.6 × 25.6 cm", "274 × 384 × 384"]);
      const images = card().locator("figure img");
      const widths = () =>
        images.evaluateAll((all) => all.map((image) => (image as HTMLImageElement).naturalWidth));
      await expect.poll(async () => (await widths()).filter((width) => width > 100).length).toBe(3);

      const [tab] = await Promise.all([
        page.waitForEvent("popup"),
        card().locator('[data-action="look"]').click(),
      ]);
      const viewer = new ViewerPage(tab);
      await tab.waitForFunction(() => window.stereocell !== undefined);
      await tab.evaluate(() => window.stereocell?.ready);
      const { channels } = (await viewer.snapshot()).state;
      expect(channels.map(({ hasSurface, shown }) => [hasSurface, shown])).toEqual([[false, true]]);
      await tab.close();

      if (IS_EXHAUSTIVE) {
        await card().locator('[data-action="build"]').click();
        await expect.poll(state, { timeout: 900_000 }).toBe("Built");
        expect(await card().getByRole("link", { name: "Open" }).isVisible()).toBe(true);
        const [id] = (await readdir(folder)).filter((name) => /^[0-9a-f]+$/.test(name));
        expect(await readdir(join(folder, id))).not.toContain("upload");
      }
      await card().locator('[data-action="delete"]').click();
      await page.getByRole("dialog").getByRole("button", { name: "Delete" }).click();
      await expect.poll(() => page.locator("article").count()).toBe(0);
      const left = async () => (await readdir(folder)).filter((name) => /^[0-9a-f]+$/.test(name));
      await expect.poll(left).toEqual([]);
      expect(faults).toEqual([]);
    }, 1_000_000);
  });
});
