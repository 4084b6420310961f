/** Files that are broken, missing or slow: the rest stays on screen, and the page says so. */
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, expect, it } from "vitest";
import { addHeadset, type Browser, launch } from "./driver/chromium";
import { Host } from "./driver/host";
import { ViewerPage } from "./driver/page";
import { isBackground, takePicture } from "./driver/picture";
import { describeInChromium } from "./driver/skip";
import { writeFixture } from "./fixture/bundle";

const DIST = new URL("../dist/", import.meta.url).pathname;
const BALLS = "channels/Balls";

describeInChromium("a faulty bundle", () => {
  let folder: string;
  let host: Host;
  let browser: Browser;
  let viewer: ViewerPage;

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-fixture-"));
    await writeFixture(folder);
    host = await Host.start({ "/": DIST, "/bundle/": folder });
    browser = await launch({ width: 640, height: 360 });
  });

  afterAll(async () => {
    await browser?.close();
    await host?.stop();
    await rm(folder, { recursive: true, force: true });
  });

  beforeEach(async () => {
    host.requests.length = 0;
    viewer = new ViewerPage(await browser.context.newPage());
  });

  afterEach(async () => {
    host.overrides.clear();
    host.delay_ms = 0;
    await viewer.page.close();
  });

  const open = (query = "") => viewer.open(`${host.address}/?bundle=bundle/${query}`);
  const notices = async () => (await viewer.snapshot()).state.notices;

  async function onlyBalls(): Promise<number> {
    await open();
    await viewer.show("F_x20_body", false);
    await viewer.settled();
    return (await viewer.snapshot()).triangles;
  }

  it("keeps the coarser surface where a finer one fails, and tries again when shown anew", async () => {
    for (const tile of ["r0_c0", "r0_c1"]) {
      const body = "gone";
      host.overrides.set(`/bundle/${BALLS}/${tile}/lod0.glb`, { status: 404, body });
      host.overrides.set(`/bundle/${BALLS}/${tile}/lod1.glb`, { status: 404, body });
    }
    const coarse = await onlyBalls();
    expect(coarse).toBeGreaterThan(0);
    const picture = await takePicture(viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    expect((await notices()).join()).toContain(`${BALLS}/r0_c0/lod1.glb: not found (404)`);

    host.overrides.clear();
    await viewer.show("Balls", false);
    await viewer.show("Balls", true);
    expect((await viewer.snapshot()).triangles).toBeGreaterThan(4 * coarse);
  });

  it("asks a busy host again", async () => {
    const path = `/bundle/${BALLS}/r0_c1/lod2.glb`;
    host.overrides.set(path, { status: 503, body: "busy", times: 2 });
    expect(await onlyBalls()).toBeGreaterThan(0);
    expect(await notices()).toEqual([]);
    expect(host.requests.filter((request) => request.path === path)).toHaveLength(3);
  });

  it("says which surface was cut short, and draws the rest", async () => {
    const path = `${BALLS}/r0_c1/lod1.glb`;
    const whole = await readFile(join(folder, path));
    const body = whole.subarray(0, whole.length - 40);
    host.overrides.set(`/bundle/${path}`, { status: 200, body });
    expect(await onlyBalls()).toBeGreaterThan(0);
    expect(await notices()).toEqual([
      `${path}: expected ${whole.length} bytes, found ${body.length} (a broken upload?)`,
    ]);
  });

  it("says that a tileset is not the one of the manifest", async () => {
    const path = `${BALLS}/tileset.json`;
    const text = await readFile(join(folder, path), "utf8");
    const body = text.replace('"1.1"', '"1.0"');
    host.overrides.set(`/bundle/${path}`, { status: 200, body });
    await open();
    expect((await notices()).join()).toContain(`${path}: expected SHA-256`);
    host.overrides.clear();
    await viewer.show("Balls", false);
    await viewer.show("Balls", true);
    const { triangles } = await viewer.snapshot();
    await viewer.show("F_x20_body", false);
    expect((await viewer.snapshot()).triangles).toBeGreaterThan(0);
    expect((await viewer.snapshot()).triangles).toBeLessThan(triangles);
  });

  it("sends the bundle's query with every file", async () => {
    await open("%3Ftoken%3Da%2Fb");
    await viewer.drawVolume("Block", true);
    const asked = host.requests.filter(({ path }) => path.startsWith("/bundle/"));
    expect(asked.some(({ path }) => path.endsWith(".glb"))).toBe(true);
    expect(asked.filter(({ query }) => query !== "?token=a/b")).toEqual([]);
    expect((await viewer.snapshot()).triangles).toBeGreaterThan(0);
  });

  it("is told in words where the address is none", async () => {
    await viewer.page.goto(`${host.address}/?bundle=${encodeURIComponent("http://")}`);
    const fatal = viewer.page.locator("[data-fatal]");
    expect(await fatal.textContent()).toContain("expected a folder's address on the web");
  });

  it("shows how far the overview has come", async () => {
    host.delay_ms = 300;
    await viewer.page.goto(`${host.address}/?bundle=bundle/`);
    const bar = viewer.page.locator("[data-progress]");
    await expect.poll(() => bar.textContent()).toMatch(/Loading the overview: \d of \d surfaces/);
    expect(await bar.isVisible()).toBe(true);
    await viewer.page.evaluate(() => window.stereocell?.ready);
    await viewer.settled();
    expect(await bar.isVisible()).toBe(false);
  });

  it("says on the page when the viewer itself fails", async () => {
    await open();
    await viewer.page.evaluate(() => {
      setTimeout(() => {
        throw new Error("a bug");
      });
      void Promise.reject(new Error("another bug"));
    });
    await expect.poll(async () => (await notices()).join()).toContain("failed: a bug");
    await expect.poll(async () => (await notices()).join()).toContain("failed: another bug");
  });

  it("draws volumes for both eyes", async () => {
    await addHeadset(viewer.page);
    await open();
    for (const id of ["F_x20_body", "Balls"]) await viewer.show(id, false);
    await viewer.drawVolume("Block", true);
    await viewer.chooseScope("all");
    await viewer.enterStereo();
    for (const x of [0, 320]) {
      const eye = await takePicture(viewer.page, { x, y: 0, width: 320, height: 360 });
      const green = eye.count(([r, g, b]) => g > 40 && g > 1.5 * r && g > 1.5 * b);
      expect(green).toBeGreaterThan(100);
    }
  });
});
