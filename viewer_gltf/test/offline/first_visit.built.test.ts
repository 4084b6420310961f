/** A visit of at most 40 s is enough to show the same picture without a network, and without a notice. */
import { cp, mkdtemp, readdir, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, inject, it } from "vitest";
import type { Browser } from "../support/browser/chromium";
import { Host } from "../support/browser/host";
import { ViewerPage } from "../support/browser/page";
import { difference, isBackground, takePicture } from "../support/browser/picture";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { DIST, MAPS_BUNDLE } from "../support/browser/stand";
import { Gate } from "../support/offline/gate";

const VISIT_MS = 40_000;
/** Share of pixels that may differ, because of the averaged noise of a view at rest. */
const SAME = 0.01;

/** Returns the parts of the page for stereo, slices and light that can't be fetched now. */
async function missing(page: Page): Promise<readonly string[]> {
  const LATER = /^(interaction|split_session|slices|path_tracer|view_sharing)-.*\.js$/;
  const names = (await readdir(join(DIST, "assets"))).filter((name) => LATER.test(name));
  expect(names.length).toBe(5);
  return page.evaluate(async (all) => {
    const have = (name: string) =>
      fetch(`assets/${name}`)
        .then(({ ok }) => ok)
        .catch(() => false);
    const found = await Promise.all(all.map(have));
    return all.filter((_, i) => !found[i]);
  }, names);
}

describeInChromium("a first visit", () => {
  let root: string;
  let host: Host;
  let gate: Gate;
  let browser: Browser;

  beforeAll(async () => {
    root = await mkdtemp(join(tmpdir(), "stereocell-visit-"));
    // If available, a bundle with transcoded textures is used, whose decoder is fetched separately.
    await cp(MAPS_BUNDLE ?? inject("fixture"), root, { recursive: true });
    await cp(DIST, root, { recursive: true });
    host = await Host.start({ "/": root });
    gate = await Gate.before(host.address);
    browser = await openBrowser({ viewport: { width: 400, height: 300 } });
  });

  afterAll(async () => {
    await browser?.close();
    await gate?.stop();
    await host?.stop();
    if (root !== undefined) await rm(root, { recursive: true, force: true });
  });

  it("announces how much is kept, and a reload without a network shows the same", async () => {
    const viewer = new ViewerPage(await browser.context.newPage());
    const { page } = viewer;
    await page.addInitScript(() => {
      const announced: string[] = [];
      Object.assign(window, { announced });
      new MutationObserver(() => {
        const text = document.querySelector("[data-announcement]")?.textContent ?? "";
        if (text !== "" && announced.at(-1) !== text) announced.push(text);
      }).observe(document, { childList: true, subtree: true, characterData: true });
    });
    const announced = () =>
      page.evaluate(() => (window as unknown as { announced: string[] }).announced);
    const started = Date.now();
    await viewer.open(`${gate.address}/?quality=low`);
    await viewer.settled();
    const before = await takePicture(page);
    await expect
      .poll(announced, { timeout: VISIT_MS - (Date.now() - started) })
      .toContainEqual(expect.stringMatching(/^(Ready|Kept for) offline: /));

    gate.shut();
    const asked = host.requests.length;
    await page.reload();
    await page.waitForFunction(() => window.stereocell !== undefined);
    await page.evaluate(() => window.stereocell?.ready);
    await viewer.settled();
    const after = await takePicture(page);
    expect((await viewer.snapshot()).state.notices).toEqual([]);
    expect(host.requests.length).toBe(asked);
    expect(before.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    expect(difference(before, after)).toBeLessThan(SAME);
    expect(await announced()).toEqual([]); // the first visit has announced it
    expect(await missing(page)).toEqual([]);
  });
});
