/** Parts that were shown once also show without a network, and files that change on the host are fetched again. */
import { cp, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, inject, it } from "vitest";
import type { Browser } from "../support/browser/chromium";
import { Host } from "../support/browser/host";
import { ViewerPage } from "../support/browser/page";
import { difference, isBackground, takePicture } from "../support/browser/picture";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { DIST } from "../support/browser/stand";
import { sha256, swapSurface } from "../support/fixture/swap";
import { Gate } from "../support/offline/gate";

const FOLDER = "/some/folder/";
const CHANGED = "channels/Balls/r0_c0/lod2.glb";
const OTHER = "channels/Balls/r0_c1/lod2.glb";

const offlineState = () => document.documentElement.dataset.offline;
/** Runs in the page: whether everything that was shown is kept. */
const isReady = () => /^(partly|ready)$/.test(document.documentElement.dataset.offline ?? "");

/** Hashes of the bundle's kept files, with the range for a part of a file. */
const keptFiles = (page: Page) =>
  page.evaluate(async () => {
    const found: string[] = [];
    for (const name of await caches.keys()) {
      for (const { url } of await (await caches.open(name)).keys()) {
        if (url.includes("/sha256/")) found.push(url.split("/sha256/")[1]);
      }
    }
    return found;
  });

const hashOf = async (path: string) => sha256(await readFile(path));

describeInChromium("without a network", () => {
  let root: string;
  let host: Host;
  let gate: Gate;
  let browser: Browser;
  let viewer: ViewerPage;

  beforeAll(async () => {
    root = await mkdtemp(join(tmpdir(), "stereocell-offline-"));
    await cp(inject("fixture"), root, { recursive: true });
    await cp(DIST, root, { recursive: true }); // the bundle contains its viewer, like on any host
    host = await Host.start({ [FOLDER]: root, "/other/": root });
    gate = await Gate.before(host.address);
  });

  beforeEach(async () => {
    browser = await openBrowser({ viewport: { width: 400, height: 300 } }); // with a new profile, which has no kept files
    viewer = new ViewerPage(await browser.context.newPage());
  });

  afterEach(async () => {
    gate.open();
    host.reset();
    await browser.close();
  });

  afterAll(async () => {
    await gate?.stop();
    await host?.stop();
    await rm(root, { recursive: true, force: true });
  });

  /** Opens the bundle with a volume in every tile. */
  async function open(query = "&mode=all"): Promise<void> {
    await viewer.open(`${gate.address}${FOLDER}?quality=low${query}`);
    await viewer.settled();
  }

  it("the page shows the same surfaces and volumes as before", async () => {
    const look = async () => {
      await open("&mode=off");
      const { triangles } = await viewer.snapshot();
      const surfaces = await takePicture(viewer.page);
      await viewer.drawVolume("Block", true);
      await viewer.chooseMode("all");
      const { state, volumes } = await viewer.snapshot();
      expect(state.notices).toEqual([]);
      return { triangles, surfaces, volumes, inside: await takePicture(viewer.page) };
    };
    const before = await look();
    expect(before.triangles).toBeGreaterThan(0);
    expect(before.volumes.length).toBeGreaterThan(0);
    expect(before.inside.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    await viewer.page.waitForFunction(isReady);
    // The worker writes its ledger a moment after it has served a file.
    await viewer.page.waitForTimeout(1000);

    gate.shut();
    const asked = host.requests.length;
    const again = await look();
    expect(again.triangles).toBe(before.triangles);
    expect(again.volumes).toEqual(before.volumes);
    expect(difference(before.surfaces, again.surfaces)).toBe(0);
    expect(difference(before.inside, again.inside)).toBe(0);
    expect(host.requests.length).toBe(asked);
  });

  it("the file for iOS's own viewer is kept only if it is small", async () => {
    const hash = await hashOf(join(root, "specimen.usdz"));
    const isThere = async () => (await keptFiles(viewer.page)).includes(hash);
    await open("&mode=off");
    await viewer.page.waitForFunction(isReady);
    expect(await isThere()).toBe(false);
    await viewer.page.addInitScript(() => {
      const { supports } = DOMTokenList.prototype;
      DOMTokenList.prototype.supports = function (token) {
        return token === "ar" || supports.call(this, token);
      };
    });
    await open("&mode=off");
    await expect.poll(isThere).toBe(true);
  });

  it("parts of files are kept under their hash and range", async () => {
    await open();
    await viewer.drawVolume("Block", true);
    await viewer.page.waitForFunction(isReady);
    const hash = await hashOf(join(root, "volumes/r0_c0/Block.ktx2"));
    const parts = async () => (await keptFiles(viewer.page)).filter((key) => key.startsWith(hash));
    await expect.poll(parts).not.toEqual([]);
    for (const key of await parts()) expect(key).toMatch(/\?bytes%3D\d+-\d+$/);
  });

  it("a damaged kept part is fetched again", async () => {
    await open();
    await viewer.drawVolume("Block", true);
    await viewer.page.waitForFunction(isReady);
    const hash = await hashOf(join(root, "volumes/r0_c0/Block.ktx2"));
    /** Returns the sums of the bytes of all kept parts of the file; first changes a byte of each if `isSpoilt`. */
    const sums = (isSpoilt: boolean) =>
      viewer.page.evaluate(
        async ([hash, isSpoilt]) => {
          const found: [string, number][] = [];
          for (const name of await caches.keys()) {
            const cache = await caches.open(name);
            for (const key of await cache.keys()) {
              if (!key.url.includes(`/sha256/${hash}?`)) continue;
              const kept = await cache.match(key);
              const bytes = new Uint8Array((await kept?.arrayBuffer()) ?? new ArrayBuffer(0));
              if (isSpoilt) bytes[5] ^= 1;
              if (isSpoilt) await cache.put(key, new Response(bytes, { headers: kept?.headers }));
              found.push([key.url, bytes.reduce((sum, byte, i) => sum + byte * (i + 1), 0)]);
            }
          }
          return found.sort();
        },
        [hash, isSpoilt] as const,
      );
    await viewer.settled();
    const asked = host.requests.filter(({ path }) => path.endsWith("volumes/r0_c0/Block.ktx2"));
    const isKept = async () => {
      const kept = (await sums(false)).map(([url]) => url);
      const parts = asked.map(({ range }) => encodeURIComponent(range ?? ""));
      return kept.length > 0 && parts.every((part) => kept.some((url) => url.endsWith(part)));
    };
    await expect.poll(isKept).toBe(true);
    const good = await sums(false);
    expect(await sums(true)).not.toEqual(good);
    await open();
    await viewer.drawVolume("Block", true);
    expect((await viewer.snapshot()).state.notices).toEqual([]);
    const isMended = async () => {
      const found = new Map(await sums(false)); // including parts that were kept since then
      return good.every(([url, sum]) => found.get(url) === sum);
    };
    await expect.poll(isMended).toBe(true);
  });

  it("only a file that changes on the host is fetched again", async () => {
    await open("");
    await viewer.page.waitForFunction(isReady);
    await viewer.page.waitForTimeout(500);
    const old = await hashOf(join(root, CHANGED));
    expect(await keptFiles(viewer.page)).toContain(old);
    expect(await keptFiles(viewer.page)).toContain(await hashOf(join(root, OTHER)));

    // Another name in the JSON chunk makes another file with the same shape.
    const glb = (await readFile(join(root, CHANGED))).toString("latin1");
    const changed = Buffer.from(glb.replace('"Balls"', '"Bills"'), "latin1");
    expect(changed.equals(Buffer.from(glb, "latin1"))).toBe(false);
    const files = await swapSurface(root, "Balls", "r0_c0/lod2.glb", changed);
    const before = await Promise.all([...files.keys()].map((path) => readFile(join(root, path))));
    try {
      for (const [path, content] of files) await writeFile(join(root, path), content);
      host.reset();
      await open("");
      const paths = host.requests.map(({ path }) => path);
      expect(paths.filter((path) => path.endsWith(".glb"))).toEqual([FOLDER + CHANGED]);
      await expect.poll(() => keptFiles(viewer.page)).toContain(sha256(changed));
      expect(await keptFiles(viewer.page)).not.toContain(old);

      gate.shut(); // the new file is kept
      await open("");
      expect((await viewer.snapshot()).state.notices).toEqual([]);
    } finally {
      for (const [i, path] of [...files.keys()].entries()) {
        await writeFile(join(root, path), before[i]);
      }
    }
  });

  it("a file that differs from files.json is not kept", async () => {
    const body = (await readFile(join(root, CHANGED))).toString("latin1");
    const wrong = Buffer.from(body.replace('"Balls"', '"Bulls"'), "latin1");
    host.overrides.set(FOLDER + CHANGED, { status: 200, body: wrong });
    await open("");
    await viewer.page.waitForFunction(isReady);
    await viewer.page.waitForTimeout(500);
    const kept = await keptFiles(viewer.page);
    expect(kept.length).toBeGreaterThan(3);
    expect(kept).not.toContain(sha256(wrong));
    expect(kept).not.toContain(await hashOf(join(root, CHANGED)));
  });

  it("a full disk does no harm", async () => {
    const devtools = await browser.context.newCDPSession(viewer.page);
    await devtools.send("Storage.overrideQuotaForOrigin", {
      origin: gate.address,
      quotaSize: 1,
    });
    await open("&mode=off");
    await expect.poll(() => viewer.page.evaluate(offlineState)).toBe("refused");
    await open("&mode=off"); // the worker now serves the page
    await viewer.drawVolume("Block", true);
    await viewer.chooseMode("all");
    const { state, volumes } = await viewer.snapshot();
    expect(state.notices).toEqual([]);
    expect(volumes.length).toBeGreaterThan(0);
    expect(await keptFiles(viewer.page)).toEqual([]);
  });

  it("nothing is kept of a bundle on another host", async () => {
    await open("");
    await viewer.page.waitForFunction(isReady);
    const other = await browser.context.newPage();
    const workers = () =>
      other.evaluate(async () => (await navigator.serviceWorker.getRegistrations()).length);
    await other.goto(`${host.address}${FOLDER}?bundle=${gate.address}${FOLDER}`);
    await other.locator("[data-fatal]").textContent(); // that host does not let other pages read its files
    expect(await workers()).toBe(0);
  });

  it("the page can be installed", async () => {
    await open("");
    const devtools = await browser.context.newCDPSession(viewer.page);
    const { errors, data } = await devtools.send("Page.getAppManifest");
    expect(errors).toEqual([]);
    const manifest = JSON.parse(data ?? "");
    expect(manifest).toMatchObject({ name: "StereoCell", start_url: "./", scope: "./" });
    for (const { src } of manifest.icons) {
      const response = await fetch(`${host.address}${FOLDER}${src}`);
      expect(response.status, src).toBe(200);
    }
  });
});
