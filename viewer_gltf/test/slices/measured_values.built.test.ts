/**
 * Measured values from `stereocell serve OUT`. They are exact under the pointer, while the 8 bits of a bundle alone are
 * rounded. Skipped if the repository has no .venv (`make setup`).
 */
import { existsSync } from "node:fs";
import { cp, mkdtemp, rm, symlink } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import type { Browser } from "../support/browser/chromium";
import { Host } from "../support/browser/host";
import { ViewerPage } from "../support/browser/page";
import { STEREOCELL, serve } from "../support/browser/served";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, DIST } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;
const QUERY = "?mode=off#v=1&slices=on&slice-x=0.31&slice-y=0.4&slice-z=0.6";
const stage = DEMO_BUNDLE === undefined ? "" : join(dirname(DEMO_BUNDLE), "stage");

/** The values of each slice, one span per channel; the style draws the separators. */
const valuesOf = (page: Page) =>
  page
    .locator(".slices .values")
    .evaluateAll((all) =>
      all.map(({ children }) => [...children].map((one) => one.textContent).join(" · ")),
    );

describe.skipIf(!existsSync(STEREOCELL) || !existsSync(stage))("values as measured", () => {
  describeInChromium("of a served build", () => {
    let out: string;
    let server: Awaited<ReturnType<typeof serve>>;
    let host: Host;
    let browser: Browser;

    beforeAll(async () => {
      out = await mkdtemp(join(tmpdir(), "stereocell-measured-"));
      await cp(DEMO_BUNDLE as string, join(out, "bundle"), { recursive: true });
      await cp(DIST, join(out, "bundle"), { recursive: true });
      await symlink(stage, join(out, "stage"));
      server = await serve(out);
      host = await Host.start({ "/": join(out, "bundle") });
      browser = await openBrowser({
        viewport: { width: 720, height: 420 },
        serviceWorkers: "block",
      });
    });
    afterAll(async () => {
      await browser?.close();
      await host?.stop();
      await server?.stop();
      await rm(out, { recursive: true, force: true });
    });

    async function open(address: string) {
      const page = await browser.context.newPage();
      const asked: string[] = [];
      page.on("request", (request) => {
        if (request.url().includes("/values/")) asked.push(request.url());
      });
      const viewer = new ViewerPage(page);
      await viewer.open(address);
      await viewer.settled();
      const texts = () => valuesOf(page);
      return { page, asked, texts };
    }

    /** The numbers in a text, channel by channel. */
    const numbers = (text: string) =>
      text.split(" · ").map((part) => Number(part.split(" ").at(-1)));

    it("come from the host under the crosshair and the pointer, and are close to those of 8 bits", async () => {
      const files = await open(`${host.address}/${QUERY}`);
      const coarse = (await files.texts())[0];
      expect(files.asked).toEqual([]);
      await files.page.close();

      const { page, asked, texts } = await open(`${server.address}${QUERY}`);
      const measured = async (address: string) => (await (await fetch(address)).json()).value;
      await expect.poll(() => asked.length).toBe(numbers(coarse).length);
      const exact = await Promise.all(asked.map(measured));
      expect(exact.every(Number.isInteger)).toBe(true); // counts of a camera
      await expect
        .poll(texts)
        .toEqual([0, 1, 2].map(() => expect.stringContaining(` ${exact[0]}`)));
      expect(numbers((await texts())[0])).toEqual(exact);
      exact.forEach((value, i) => {
        // The 8-bit values are interpolated between voxels.
        expect(Math.abs(value - numbers(coarse)[i])).toBeLessThan(0.25 * Math.max(400, value));
      });

      const before = asked.length;
      const box = await page.locator('[data-slice="0"]').boundingBox();
      if (box === null) throw new Error("no picture");
      await page.mouse.move(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
      await expect.poll(() => asked.length).toBeGreaterThan(before);
      const under = await Promise.all(asked.slice(before).map(measured));
      await expect.poll(async () => numbers((await texts())[0])).toEqual(under);
      if (SHOTS) await page.screenshot({ path: `${SHOTS}/measured_values.png` });
      await page.close();
    });

    it("are those of 8 bits if the host no longer answers", async () => {
      const { page, asked, texts } = await open(`${host.address}/${QUERY}`);
      const coarse = await texts();
      await page.close();
      const broken = await browser.context.newPage();
      await broken.route("**/values/**", (route) => route.abort());
      const viewer = new ViewerPage(broken);
      await viewer.open(`${server.address}${QUERY}`);
      await viewer.settled();
      expect(asked).toEqual([]);
      await expect.poll(() => valuesOf(broken)).toEqual(coarse);
      await broken.close();
    });
  });
});
