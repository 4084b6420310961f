/** The announcements about a visit without a network are true: each tile that they promise shows like before. */
import { cp, mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, expect, inject, it } from "vitest";
import type { Browser } from "../support/browser/chromium";
import { Host } from "../support/browser/host";
import { ViewerPage } from "../support/browser/page";
import { difference, isBackground, type Picture, takePicture } from "../support/browser/picture";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { DIST } from "../support/browser/stand";

/** Share of pixels that may differ, in addition to those that blend differently each time they are drawn. */
const SAME = 0.002;

describeInChromium("the announcements about a visit without a network", () => {
  let root: string;
  let host: Host;
  let browser: Browser;
  let viewer: ViewerPage;

  beforeAll(async () => {
    root = await mkdtemp(join(tmpdir(), "stereocell-places-"));
    await cp(inject("fixture"), root, { recursive: true });
    await cp(DIST, root, { recursive: true }); // the bundle contains its viewer, like on any host
    host = await Host.start({ "/": root });
  });

  beforeEach(async () => {
    browser = await openBrowser({ viewport: { width: 400, height: 300 } });
    viewer = new ViewerPage(await browser.context.newPage());
    await viewer.page.addInitScript(() => {
      localStorage.setItem("stereocell-open", "channels more volumes tiles");
      const announced: string[] = [];
      Object.assign(window, { announced });
      new MutationObserver(() => {
        const text = document.querySelector("[data-announcement]")?.textContent ?? "";
        if (/offline/.test(text) && announced.at(-1) !== text) announced.push(text);
      }).observe(document, { childList: true, subtree: true, characterData: true });
    });
    await viewer.open(`${host.address}/?quality=low&mode=tile&switch=9&view=front#v=1&depth=0`);
    await viewer.settled();
  });

  afterEach(async () => {
    await browser.context.setOffline(false);
    await browser.close();
  });

  afterAll(async () => {
    await host?.stop();
    await rm(root, { recursive: true, force: true });
  });

  const announced = () =>
    viewer.page.evaluate(() => (window as unknown as { announced: readonly string[] }).announced);
  const offline = () => viewer.page.evaluate(() => document.documentElement.dataset.offline);
  const notices = async () => (await viewer.snapshot()).state.notices;
  const tiles = async () => (await viewer.snapshot()).state.tiles.map(({ id }) => id);

  async function visit(tile: string): Promise<Picture> {
    await viewer.chooseTile(tile);
    await viewer.still();
    expect((await viewer.snapshot()).volumes.map((volume) => volume.tile)).toContain(tile);
    return takePicture(viewer.page);
  }

  async function reload(): Promise<void> {
    await viewer.page.reload();
    await viewer.page.waitForFunction(() => window.stereocell !== undefined);
    await viewer.page.evaluate(() => window.stereocell?.ready);
    await viewer.settled();
  }

  it("promise every tile after each was shown, and each shows without a network", async () => {
    const all = await tiles();
    const first = `Kept for offline: the overview and 1 of ${all.length} tiles. A tile is also kept once you have looked at it from near.`;
    await expect.poll(announced).toEqual([first]);
    expect(await offline()).toBe("partly");
    const seen = new Map<string, Picture>();
    for (const tile of all) seen.set(tile, await visit(tile));
    await expect.poll(offline).toBe("ready");
    expect(await announced()).toEqual([first, expect.stringMatching(/^Ready offline: /)]);

    await viewer.page.waitForTimeout(1000); // the address then contains the last view
    const atLast = await takePicture(viewer.page);
    await browser.context.setOffline(true);
    const asked = host.requests.length;
    await reload();
    expect(difference(atLast, await takePicture(viewer.page))).toBeLessThan(SAME);
    for (const [tile, picture] of seen) {
      expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
      if ((await viewer.snapshot()).state.selected === tile) await viewer.chooseTile(all[0]);
      expect(difference(picture, await visit(tile)), tile).toBeLessThan(SAME);
    }
    expect(await notices()).toEqual([]);
    expect(host.requests.length).toBe(asked);
    expect(await announced()).toEqual([]); // an earlier visit has announced it
  });

  it("name the number of kept tiles; at other tiles the page reports that it is offline, until it is online", async () => {
    const [volume] = (await viewer.snapshot()).volumes;
    await expect.poll(offline).toBe("partly");
    const other = (await tiles()).find((tile) => tile !== volume.tile) ?? "";
    await browser.context.setOffline(true);
    await reload();
    expect(await notices()).toEqual([]);
    await viewer.page.locator(`[data-tile-choice="${other}"]`).click();
    await expect.poll(notices).toEqual([expect.stringMatching(/^This device is offline/)]);
    await browser.context.setOffline(false);
    await expect.poll(notices).toEqual([]);
    await viewer.settled();
    const { volumes } = await viewer.snapshot();
    expect(volumes.find(({ tile }) => tile === other)?.level).toBe(volume.level);
  });
});
