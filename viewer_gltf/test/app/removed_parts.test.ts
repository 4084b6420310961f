/** A part is one folder and one line. Without both, the rest of the viewer type-checks, builds and opens. */
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
import { buildPage, copyWithout, registeredParts } from "../support/without_parts";

/** Parts whose copies are built and opened, by folder, with the panel section of each. */
const OPENED: Readonly<Record<string, string>> = {
  annotations: "measure",
  capture: "save",
  objects: "objects",
  pathtrace: "light",
  slices: "slices",
};
const FOLDERS = Object.keys(OPENED);
/** The folder with which the page's entry reads its address. It stays when the part's line is removed. */
const READS_ADDRESS = "share";

const PARTS = await registeredParts();

const copies = new Map<string, Promise<string>>();
let folder = "";

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), "stereocell-without-"));
});

afterAll(() => rm(folder, { recursive: true }));

/** Returns the copy of the viewer without a part, made at the first request. */
function without(part: string): Promise<string> {
  const kept = part === READS_ADDRESS ? [part] : [];
  const copy = copies.get(part) ?? copyWithout([part], join(folder, part), kept);
  copies.set(part, copy);
  return copy;
}

/** Returns the faults that the compiler finds in a copy; "": none. */
async function faultsOf(copy: string): Promise<string> {
  const compiler = join(copy, "node_modules/.bin/tsc");
  const done = await promisify(execFile)(compiler, ["--noEmit", "-p", "tsconfig.page.json"], {
    cwd: copy,
  }).catch((error: { stdout: string }) => error);
  return done.stdout;
}

describe("the viewer", () => {
  it("is tested without parts that are registered", () => {
    expect(PARTS).toEqual(expect.arrayContaining(FOLDERS));
  });

  it.each(PARTS)("type-checks without the folder and the line of %s", async (part) => {
    expect(await faultsOf(await without(part))).toBe("");
  });
});

describeInChromium("the page", () => {
  let browser: Browser;

  beforeAll(async () => {
    browser = await openBrowser({ viewport: { width: 480, height: 320 }, serviceWorkers: "block" });
  });

  afterAll(() => browser?.close());

  it.each(FOLDERS)(
    "without %s draws the specimen, and has the sections of the other parts",
    async (removed) => {
      const built = await buildPage(await without(removed));
      const host = await Host.start({ "/app/": built, "/bundle/": inject("fixture") });
      const page = await browser.context.newPage();
      try {
        const faults: string[] = [];
        page.on("pageerror", ({ message }) => faults.push(message));
        const viewer = new ViewerPage(page);
        await viewer.open(`${host.address}/app/?bundle=../bundle/&view=front&quality=low`);
        await viewer.settled();
        expect((await viewer.snapshot()).triangles).toBeGreaterThan(0);

        await page.locator('h2 [data-opener="more"]').click();
        const openers = await page
          .locator("h2 [data-opener]")
          .evaluateAll((each) => each.map((opener) => (opener as HTMLElement).dataset.opener));
        const ofParts = FOLDERS.filter((part) => openers.includes(OPENED[part]));
        // the fixture has no label map, so no page has a section of objects
        const isThere = (part: string) => part !== "objects" && part !== removed;
        expect(ofParts).toEqual(FOLDERS.filter(isThere));
        expect(openers).toContain("channels");

        await viewer.clickOnce(240, 160);
        await expect.poll(async () => (await viewer.snapshot()).state.selected).not.toBeNull();
        expect(faults).toEqual([]);
      } finally {
        await page.close();
        await host.stop();
      }
    },
  );
});
