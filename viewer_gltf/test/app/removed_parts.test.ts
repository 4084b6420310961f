/** A part is one folder and one line: without both, the rest of the viewer type-checks, builds and opens. */
import { execFile } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { afterAll, beforeAll, describe, expect, inject, it } from "vitest";
import type { Browser } from "../support/browser/chromium";
import { Host } from "../support/browser/host";
import { ViewerPage } from "../support/browser/page";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { buildPage, copyWithout } from "../support/without_parts";

/** Parts of the viewer, by folder, and the sections of the panel that each has. */
const PARTS = {
  annotations: "measure",
  capture: "save",
  objects: "objects",
  slices: "slices",
} as const;
const FOLDERS = Object.keys(PARTS);

/** The faults that the compiler finds in a copy; "": none. */
async function faultsOf(copy: string): Promise<string> {
  const compiler = join(copy, "node_modules/.bin/tsc");
  const done = await promisify(execFile)(compiler, ["--noEmit", "-p", "tsconfig.page.json"], {
    cwd: copy,
  }).catch((error: { stdout: string }) => error);
  return done.stdout;
}

describe("the viewer", () => {
  it.each(FOLDERS)("type-checks without the folder and the line of %s", async (part) => {
    const folder = await mkdtemp(join(tmpdir(), "stereocell-without-"));
    try {
      expect(await faultsOf(await copyWithout([part], folder))).toBe("");
    } finally {
      await rm(folder, { recursive: true });
    }
  });
});

describeInChromium("the page without these parts", () => {
  let folder: string;
  let host: Host;
  let browser: Browser;

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-without-"));
    const page = await buildPage(await copyWithout(FOLDERS, folder));
    host = await Host.start({ "/app/": page, "/bundle/": inject("fixture") });
    browser = await openBrowser({ viewport: { width: 480, height: 320 }, serviceWorkers: "block" });
  });

  afterAll(async () => {
    await browser?.close();
    await host?.stop();
    await rm(folder, { recursive: true });
  });

  it("draws the specimen, takes a choice in it, and has the sections of the others alone", async () => {
    const page = await browser.context.newPage();
    const faults: string[] = [];
    page.on("pageerror", ({ message }) => faults.push(message));
    const viewer = new ViewerPage(page);
    await viewer.open(`${host.address}/app/?bundle=../bundle/&view=front&quality=low`);
    await viewer.settled();
    const { triangles } = await viewer.snapshot();
    expect(triangles).toBeGreaterThan(0);

    await page.locator('h2 [data-opener="more"]').click();
    const openers = await page
      .locator("h2 [data-opener]")
      .evaluateAll((each) => each.map((opener) => (opener as HTMLElement).dataset.opener));
    expect(openers).toContain("channels");
    expect(openers.filter((id) => Object.values<unknown>(PARTS).includes(id))).toEqual([]);

    await viewer.clickOnce(240, 160);
    await expect.poll(async () => (await viewer.snapshot()).state.selected).not.toBeNull();
    expect(faults).toEqual([]);
  });
});
