/** Files that are damaged, missing or slow: the rest stays on screen, and the page reports the fault. */
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { expect, it } from "vitest";
import { addHeadset } from "../support/browser/chromium";
import { isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const BALLS = "channels/Balls";

describeInChromium("a faulty bundle", () => {
  const stand = prepareStand({ viewport: { width: 640, height: 360 } });
  const notices = async () => (await stand.viewer.snapshot()).state.notices;

  async function onlyBalls(): Promise<number> {
    await stand.open();
    await stand.viewer.show("F_x20_body", false);
    await stand.viewer.settled();
    return (await stand.viewer.snapshot()).triangles;
  }

  it("keeps the coarser surface where a finer one fails, and tries again when shown again", async () => {
    for (const tile of ["r0_c0", "r0_c1"]) {
      const body = "gone";
      stand.host.overrides.set(`/bundle/${BALLS}/${tile}/lod0.glb`, { status: 404, body });
      stand.host.overrides.set(`/bundle/${BALLS}/${tile}/lod1.glb`, { status: 404, body });
    }
    const coarse = await onlyBalls();
    expect(coarse).toBeGreaterThan(0);
    const picture = await takePicture(stand.viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    expect((await notices()).join()).toContain(`${BALLS}/r0_c0/lod1.glb: not found (404)`);

    stand.host.overrides.clear();
    await stand.viewer.show("Balls", false);
    await stand.viewer.show("Balls", true);
    expect((await stand.viewer.snapshot()).triangles).toBeGreaterThan(4 * coarse);
  });

  it("requests a file of a busy host again", async () => {
    const path = `/bundle/${BALLS}/r0_c1/lod2.glb`;
    stand.host.overrides.set(path, { status: 503, body: "busy", times: 2 });
    expect(await onlyBalls()).toBeGreaterThan(0);
    expect(await notices()).toEqual([]);
    expect(stand.host.requests.filter((request) => request.path === path)).toHaveLength(3);
  });

  it("reports which surface was cut short, and draws the rest", async () => {
    const path = `${BALLS}/r0_c1/lod1.glb`;
    const whole = await readFile(join(stand.bundle, path));
    const body = whole.subarray(0, whole.length - 40);
    stand.host.overrides.set(`/bundle/${path}`, { status: 200, body });
    expect(await onlyBalls()).toBeGreaterThan(0);
    expect(await notices()).toEqual([
      `${path}: found ${body.length} bytes, expected ${whole.length}: upload the file again`,
    ]);
  });

  it("reports that a tileset differs from the one in the manifest", async () => {
    const path = `${BALLS}/tileset.json`;
    const text = await readFile(join(stand.bundle, path), "utf8");
    const body = text.replace('"1.1"', '"1.0"');
    stand.host.overrides.set(`/bundle/${path}`, { status: 200, body });
    await stand.open();
    expect((await notices()).join()).toContain(`${path}: expected SHA-256`);
    stand.host.overrides.clear();
    await stand.viewer.show("Balls", false);
    await stand.viewer.show("Balls", true);
    const { triangles } = await stand.viewer.snapshot();
    await stand.viewer.show("F_x20_body", false);
    expect((await stand.viewer.snapshot()).triangles).toBeGreaterThan(0);
    expect((await stand.viewer.snapshot()).triangles).toBeLessThan(triangles);
  });

  it("sends the bundle's query with every file", async () => {
    await stand.open("%3Ftoken%3Da%2Fb");
    await stand.viewer.drawVolume("Block", true);
    const asked = stand.host.requests.filter(({ path }) => path.startsWith("/bundle/"));
    expect(asked.some(({ path }) => path.endsWith(".glb"))).toBe(true);
    expect(asked.filter(({ query }) => query !== "?token=a/b")).toEqual([]);
    expect((await stand.viewer.snapshot()).triangles).toBeGreaterThan(0);
  });

  it("is reported if its address is invalid", async () => {
    await stand.viewer.page.goto(
      `${stand.host.address}/app/?bundle=${encodeURIComponent("http://")}`,
    );
    const fatal = stand.viewer.page.locator("[data-fatal]");
    expect(await fatal.textContent()).toContain("expected a folder's address on the web");
  });

  it("shows the progress of the overview", async () => {
    stand.host.delay_ms = 300;
    await stand.viewer.page.goto(`${stand.host.address}/app/?bundle=../bundle/`);
    const bar = stand.viewer.page.locator("[data-progress]");
    await expect.poll(() => bar.textContent()).toMatch(/Loading the overview: \d of \d surfaces/);
    expect(await bar.isVisible()).toBe(true);
    await stand.viewer.page.evaluate(() => window.stereocell?.ready);
    await stand.viewer.settled();
    expect(await bar.isVisible()).toBe(false);
  });

  it("reports on the page when the viewer itself fails", async () => {
    await stand.open();
    await stand.viewer.page.evaluate(() => {
      setTimeout(() => {
        throw new Error("a bug");
      });
      void Promise.reject(new Error("another bug"));
    });
    await expect.poll(async () => (await notices()).join()).toContain("failed: a bug");
    await expect.poll(async () => (await notices()).join()).toContain("failed: another bug");
  });

  it("draws volumes for both eyes", async () => {
    await addHeadset(stand.viewer.page);
    await stand.open();
    for (const id of ["F_x20_body", "Balls"]) await stand.viewer.show(id, false);
    await stand.viewer.drawVolume("Block", true);
    await stand.viewer.chooseMode("all");
    await stand.viewer.enterStereo();
    for (const x of [0, 320]) {
      const eye = await takePicture(stand.viewer.page, { x, y: 0, width: 320, height: 360 });
      const green = eye.count(([r, g, b]) => g > 40 && g > 1.5 * r && g > 1.5 * b);
      expect(green).toBeGreaterThan(100);
    }
  });
});
