/**
 * The viewer and a bundle in one file, opened from a disk: it shows the same as the served page,
 * and contacts no host.
 */
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { afterAll, beforeAll, beforeEach, describe, expect, it } from "vitest";
import { type Browser, hasChromium } from "../support/browser/chromium";
import { Firefox, HOW_TO_GET_FIREFOX, hasFirefox } from "../support/browser/firefox";
import { ViewerPage } from "../support/browser/page";
import { difference, isBackground, Picture, takePicture } from "../support/browser/picture";
import { decodePng } from "../support/browser/png";
import { openBrowser } from "../support/browser/shared_browser";
import { prepareStand } from "../support/browser/stand";
import { askPython, hasPython } from "../support/python";

const VIEWPORT = { width: 480, height: 300 };
/** Share of pixels that may differ, because of the averaged noise of a view at rest. */
const SAME = 0.01;
const VIEW = "#v=1&eye=0.5,0.4,1.2,0,0,0";

describe.skipIf(!hasChromium() || !hasPython)("a scene in one file", () => {
  const stand = prepareStand({ viewport: VIEWPORT });
  let folder: string;
  let browser: Browser;
  let viewer: ViewerPage;
  /** Addresses that the page has requested, except blobs and data URLs of its own. */
  let requested: string[];

  const fileOf = (name: string) => join(folder, `${name}.html`);
  const write = (name: string, ...more: readonly string[]) =>
    askPython("scene_page", [stand.bundle, fileOf(name), ...more], "");
  const open = (name: string, end = "") => viewer.open(pathToFileURL(fileOf(name)).href + end);

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-scene-"));
    browser = await openBrowser({ viewport: VIEWPORT });
    await write("whole");
  });

  afterAll(async () => {
    await browser?.close();
    if (folder !== undefined) await rm(folder, { recursive: true, force: true });
  });

  beforeEach(async () => {
    await viewer?.page.close();
    viewer = new ViewerPage(await browser.context.newPage());
    await viewer.page.context().setOffline(true);
    requested = [];
    viewer.page.on("request", (request) => {
      if (!/^(blob|data):/.test(request.url())) requested.push(request.url());
    });
  });

  it("shows the same as the served page without a network, and requests only itself", async () => {
    await stand.open(`&mode=all${VIEW}`);
    await stand.viewer.settled();
    const served = await takePicture(stand.viewer.page);
    await open("whole", `?mode=all&quality=low&view=front${VIEW}&depth=0`);
    await viewer.settled();
    const { state, volumes } = await viewer.snapshot();
    expect(state.notices).toEqual([]);
    expect(volumes.length).toBeGreaterThan(0);
    const picture = await takePicture(viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    expect(difference(picture, served)).toBeLessThan(SAME);
    expect(requested.map((address) => new URL(address).pathname)).toEqual([
      pathToFileURL(fileOf("whole")).pathname,
    ]);
  });

  it("has a policy that forbids its own code to contact a host", async () => {
    await open("whole");
    const tries = await viewer.page.evaluate(async () => {
      const fails = (job: () => Promise<unknown>) =>
        job().then(
          () => "reached",
          () => "refused",
        );
      const image = () =>
        new Promise((resolve, reject) => {
          const made = new Image();
          made.onload = resolve;
          made.onerror = reject;
          made.src = "https://host.example/a.png";
        });
      const violations: string[] = [];
      addEventListener("securitypolicyviolation", (event) =>
        violations.push(event.effectiveDirective),
      );
      const results = [await fails(() => fetch("https://host.example/a.json")), await fails(image)];
      await new Promise((resolve) => setTimeout(resolve, 0));
      return { results, violations: violations.sort() };
    });
    expect(tries).toEqual({
      results: ["refused", "refused"],
      violations: ["connect-src", "img-src"],
    });
  });

  it("opens with the view of a link, and keeps a view in its address through a reload", async () => {
    await write("view", "25", `https://host.example/page${VIEW}`);
    await open("view");
    const eye = async () => (await viewer.snapshot()).look.position.map((v) => v.toFixed(2));
    expect(await eye()).toEqual(["0.50", "0.40", "1.20"]);
    const [channel] = (await viewer.snapshot()).state.channels;
    await viewer.show(channel.id, false);
    await viewer.page.keyboard.press("l");
    await expect.poll(() => viewer.page.url()).toContain("#v=1&c=");
    await viewer.page.reload();
    await viewer.page.waitForFunction(() => window.stereocell !== undefined);
    await viewer.page.evaluate(() => window.stereocell?.ready);
    expect((await viewer.snapshot()).state.channels[0].shown).toBe(false);
    expect(await eye()).toEqual(["0.50", "0.40", "1.20"]);
  });

  it("styles parts that are loaded later like the served page, without an error", async () => {
    const errors: string[] = [];
    viewer.page.on("console", (message) => {
      if (message.type() === "error") errors.push(message.text());
    });
    await open("whole", `?view=front${VIEW}`);
    await stand.open(VIEW);
    const stylesOf = async (page: ViewerPage["page"]) => {
      await page.keyboard.press("Enter"); // opens the card of the middle of the view
      const card = page.locator(".tap-card");
      await card.waitFor();
      const ofCard = await card.evaluate((each) => {
        const { position, borderRadius, padding } = getComputedStyle(each);
        return [position, borderRadius, padding];
      });
      await page.keyboard.press("?");
      const keys = page.locator("dialog[data-help] kbd").first();
      await keys.waitFor();
      return [...ofCard, await keys.evaluate((each) => getComputedStyle(each).borderWidth)];
    };
    const served = await stylesOf(stand.viewer.page);
    expect(await stylesOf(viewer.page)).toEqual(served);
    expect(served[0]).toBe("absolute");
    expect(errors).toEqual([]);
  });

  it("is path-traced with the environment light in the file", async () => {
    const errors: string[] = []; // the policy forbids to fetch a light from elsewhere
    viewer.page.on("console", (message) => {
      if (message.type() === "error") errors.push(message.text());
    });
    await open("whole", "?mode=traced&quality=low");
    const samples = async () => (await viewer.snapshot()).traced.samples;
    await expect.poll(samples, { timeout: 60_000 }).toBeGreaterThan(0);
    expect((await viewer.snapshot()).state.notices).toEqual([]);
    expect(errors).toEqual([]);
  });

  it("draws only the coarse levels that fit, without a notice", async () => {
    const refusal = await write("none", "0.1").catch((error: Error) => error.message);
    const [, least] = /expected at least ([\d.]+), as the page/.exec(refusal) ?? [];
    expect(Number(least)).toBeGreaterThan(0.5);
    const about = await write("small", String(Number(least) + 0.005));
    expect(about).toMatch(
      /left out: \d+ finer levels? of detail, \d+ finer resolution levels? of volumes/,
    );
    await open("small", "?mode=all&quality=low");
    await viewer.settled();
    const { state, volumes } = await viewer.snapshot();
    expect(state.notices).toEqual([]);
    expect(Math.max(...volumes.map(({ level }) => level ?? -1))).toBe(0);
    const picture = await takePicture(viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    await viewer.chooseMode("off");
    expect((await viewer.snapshot()).triangles).toBeGreaterThan(0);
  });

  if (!hasFirefox) process.stderr.write(`skipped: a scene in Firefox: ${HOW_TO_GET_FIREFOX}\n`);
  it.skipIf(!hasFirefox)("opens in Firefox from a disk and asks no host", async () => {
    const firefox = await Firefox.start();
    try {
      await firefox.open(`${pathToFileURL(fileOf("whole")).href}?mode=all&quality=low`);
      const result = await firefox.run(IN_FIREFOX);
      expect(result).toEqual({ notices: [], hasVolumes: true, hosts: [] });
      const { width, height, rgba } = decodePng(await firefox.screenshot());
      const picture = new Picture(width, height, rgba);
      expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(5000);
      const { swatch, at } = (await firefox.run(SWATCH)) as { swatch: string; at: number[] };
      const pixel = 4 * (at[1] * width + at[0]);
      const found = [...rgba.subarray(pixel, pixel + 3)];
      expect(`#${found.map((v) => v.toString(16).padStart(2, "0")).join("")}`).toBe(swatch);
    } finally {
      await firefox.stop();
    }
  });
});

/** Runs in the page: its state, and the addresses of hosts that it has contacted. */
const IN_FIREFOX = `
  const resolve = arguments[arguments.length - 1];
  const wait = (time_ms) => new Promise((then) => setTimeout(then, time_ms));
  (async () => {
    while (window.stereocell === undefined) await wait(50);
    await window.stereocell.ready;
    await window.stereocell.settled();
    const { state, volumes } = window.stereocell.snapshot();
    const names = performance.getEntriesByType("resource").map(({ name }) => name);
    resolve({
      notices: state.notices,
      hasVolumes: volumes.length > 0,
      hosts: names.filter((name) => !/^(blob|data):/.test(name)),
    });
  })().catch((error) => resolve(String(error)));
`;

/** Runs in the page: the colour of the first channel, and the middle of its swatch in the window. */
const SWATCH = `
  const input = document.querySelector("input[type=color]");
  const { left, top, width, height } = input.getBoundingClientRect();
  arguments[arguments.length - 1]({
    swatch: input.value,
    at: [Math.round(left + width / 2), Math.round(top + height / 2)],
  });
`;
