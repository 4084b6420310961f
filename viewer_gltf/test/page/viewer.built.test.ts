/** The built viewer in headless Chromium, with the synthetic fixture and with the bundle of the demo. */
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { beforeAll, expect, it } from "vitest";
import { addHeadset } from "../support/browser/chromium";
import { hasColor, isBackground, type Pixel, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, DIST, prepareStand, type Stand } from "../support/browser/stand";

const VIEWPORT = { width: 480, height: 270 };
/** A tile of the demo beside which two remaining slices of cells are thinner than 1 um. */
const OPEN_TILE = "r0_c2";

const withSurface = ({ manifest }: Stand) =>
  manifest.channels.filter(({ tileset }) => tileset !== null);

describeInChromium("the demo", () => {
  const stand = prepareStand({ bundle: DEMO_BUNDLE, viewport: VIEWPORT, sharesPage: true });
  /** Levels of the surfaces that the page requested until everything was loaded, in their order. */
  let lods: readonly number[];

  beforeAll(async () => {
    await stand.open();
    await stand.viewer.settled();
    lods = stand.host.requests.flatMap(({ path }) => {
      const lod = /\/lod(\d+)\.glb$/.exec(path)?.[1];
      return lod === undefined ? [] : [Number(lod)];
    });
  });

  it("fetches every tile's coarsest surface before any finer one", () => {
    const coarsest = Math.max(...lods);
    const first = lods.findIndex((lod) => lod < coarsest);
    const overview = first === -1 ? lods : lods.slice(0, first);
    expect(overview.length).toBe(lods.filter((lod) => lod === coarsest).length);
  });

  it("loads the bundle and draws each channel in its colour", async () => {
    const { overview } = await stand.viewer.snapshot();
    expect(overview.isComplete).toBe(true);
    expect(overview.total).toBeGreaterThan(0);
    const all = await takePicture(stand.viewer.page);
    expect(all.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    for (const { id, color } of withSurface(stand)) {
      await stand.viewer.showOnly(id);
      expect((await takePicture(stand.viewer.page)).count(hasColor(color)), id).toBeGreaterThan(
        100,
      );
    }
  });

  it("draws no thin remaining slices beside the tile that is a volume", async () => {
    const triangles = async () => (await stand.viewer.snapshot()).triangles;
    await stand.open(`#v=1&mode=off&tile=${OPEN_TILE}`);
    await stand.viewer.settled();
    const all = await triangles();
    await stand.open(`#v=1&mode=off&only=${OPEN_TILE}`);
    await stand.viewer.settled();
    const own = await triangles();
    await stand.open(`#v=1&mode=tile&switch=9&tile=${OPEN_TILE}`);
    await stand.viewer.settled();
    expect((await stand.viewer.snapshot()).volumes.map(({ tile }) => tile)).toContain(OPEN_TILE);
    expect(await triangles()).toBeLessThan(all - own);
  });
});

describeInChromium("the viewer", () => {
  const stand = prepareStand({
    viewport: VIEWPORT,
    pixelRatio: 1,
    mounts: (bundle) => ({
      "/some/folder/": bundle,
      "/some/folder/assets/": join(DIST, "assets"),
    }),
  });

  const picture = () => takePicture(stand.viewer.page);

  it("opens the bundle beside the page, in any folder of a host", async () => {
    const body = await readFile(join(DIST, "index.html"));
    stand.host.overrides.set("/some/folder/index.html", { status: 200, body });
    await stand.viewer.open(`${stand.host.address}/some/folder/index.html`);
    await stand.viewer.settled();
    expect((await picture()).count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    const outside = stand.host.requests.filter(({ path }) => !path.startsWith("/some/folder/"));
    expect(outside).toEqual([]);
  });

  it("requests nothing outside the page and the bundle", async () => {
    const addresses: string[] = [];
    stand.viewer.page.on("request", (request) => addresses.push(request.url()));
    await stand.open();
    await stand.viewer.settled();
    const local = (url: string) => url.startsWith(stand.host.address) || /^(data|blob):/.test(url);
    expect(addresses.filter((url) => !local(url))).toEqual([]);
  });

  it("removes a channel's colour when the channel is hidden", async () => {
    const { id, color } = withSurface(stand)[0];
    await stand.open();
    await stand.viewer.settled();
    await stand.viewer.showOnly(id);
    expect((await picture()).count(hasColor(color))).toBeGreaterThan(100);
    await stand.viewer.show(id, false);
    expect((await picture()).count((pixel) => !isBackground(pixel))).toBe(0);
  });

  it("recolours the surface and the volume without fetching the volume again", async () => {
    const { id, color } = withSurface(stand)[0];
    const chosen: Pixel = [1, 0, 1];
    await stand.open();
    await stand.viewer.settled();
    await stand.viewer.showOnly(id);
    await stand.viewer.recolor(id, "#ff00ff");
    const surface = await picture();
    expect(surface.count(hasColor(chosen))).toBeGreaterThan(100);
    expect(surface.count(hasColor(color))).toBe(0);

    await stand.viewer.drawVolume(id, true);
    await stand.viewer.chooseMode("all");
    const volumes = await stand.viewer.snapshot();
    expect(volumes.volumes).toHaveLength(stand.manifest.tiles.length);
    expect(volumes.triangles).toBe(0); // volumes replace the surfaces
    expect((await picture()).count(hasColor(chosen))).toBeGreaterThan(100);

    const before = stand.host.requests.length;
    await stand.viewer.recolor(id, "#00ff00");
    const recoloured = await picture();
    expect(recoloured.count(hasColor([0, 1, 0]))).toBeGreaterThan(100);
    expect(recoloured.count(hasColor(chosen))).toBe(0);
    // the browser requests the icon of the page at any time
    const requested = stand.host.requests.slice(before).map(({ path }) => path);
    expect(requested.filter((path) => path !== "/app/icon.svg")).toEqual([]);
  });

  /** Shows one channel, as a volume in one tile. */
  async function openTileOf(id: string): Promise<string> {
    // otherwise the page may have begun to load this and other tiles
    await stand.open("&mode=off&switch=9");
    await stand.viewer.showOnly(id);
    const [{ id: tile }] = stand.manifest.tiles;
    await stand.viewer.chooseTile(tile);
    await stand.viewer.chooseMode("tile");
    return tile;
  }

  it("fetches a volume by ranges, from coarse to fine", async () => {
    const { id } = stand.manifest.channels[0];
    const tile = await openTileOf(id);
    const { volumes } = await stand.viewer.snapshot();
    const path = `/bundle/volumes/${tile}/${id}.ktx2`;
    const ranges = stand.host.requests.filter((each) => each.path === path);
    expect(ranges.length).toBeGreaterThan(1);
    const sizes = ranges.map(({ range }) => {
      const [first, last] = (range ?? "").slice("bytes=".length).split("-").map(Number);
      return last - first;
    });
    expect(sizes).toEqual([...sizes].sort((a, b) => a - b));
    expect(volumes).toEqual([{ tile, channel: id, level: 0 }]);
  });

  it("fetches the whole file from a host without ranges", async () => {
    stand.host.hasRanges = false;
    const { id } = stand.manifest.channels[0];
    const tile = await openTileOf(id);
    const { state, volumes } = await stand.viewer.snapshot();
    const path = `/bundle/volumes/${tile}/${id}.ktx2`;
    expect(stand.host.requests.filter((each) => each.path === path)).toHaveLength(1);
    expect(volumes).toEqual([{ tile, channel: id, level: 0 }]);
    expect(state.notices).toEqual([]);
  });

  it("draws a different image for each eye", async () => {
    await addHeadset(stand.viewer.page);
    await stand.open("&mode=off");
    await stand.viewer.settled();
    await stand.viewer.enterStereo();
    const half = VIEWPORT.width / 2;
    const eye = (x: number) =>
      takePicture(stand.viewer.page, { x, y: 0, width: half, height: VIEWPORT.height });
    const [left, right] = [await eye(0), await eye(half)];
    const drawn = [left, right].map((each) => each.where((pixel) => !isBackground(pixel)));
    expect(Math.min(...drawn.map((each) => each.length))).toBeGreaterThan(300);
    // The left eye sees the specimen further to the right.
    const [a, b] = drawn.map((each) => each.reduce((sum, [x]) => sum + x, 0) / each.length);
    expect(a - b).toBeGreaterThan(1);
    expect(a - b).toBeLessThan(half / 4);
  });

  it("reports why stereo cannot start without a headset", async () => {
    await stand.open();
    const reason = stand.viewer.page.locator("[data-stereo-reason]");
    await expect.poll(() => reason.textContent()).toContain("headset");
    expect(await stand.viewer.page.locator('[data-action="stereo"]').isDisabled()).toBe(true);
  });

  async function fatalText(address: string): Promise<string> {
    await stand.viewer.page.goto(address);
    return (await stand.viewer.page.locator("[data-fatal]").textContent({ timeout: 20_000 })) ?? "";
  }

  it("reports on the page which file is missing", async () => {
    const text = await fatalText(`${stand.host.address}/app/?bundle=../nowhere/`);
    expect(text).toContain("manifest.json: not found (404)");
    expect(text).toContain("/nowhere/manifest.json");
  });

  it("reports on the page which version it found and which it reads", async () => {
    const body = JSON.stringify({ ...stand.manifest, version: 99 });
    stand.host.overrides.set("/bundle/manifest.json", { status: 200, body });
    const text = await fatalText(`${stand.host.address}/app/?bundle=../bundle/`);
    expect(text).toContain("version is 99, expected 1");
  });

  it("reports on the page that a file is no JSON", async () => {
    stand.host.overrides.set("/bundle/manifest.json", {
      status: 200,
      body: "<html>Sign in</html>",
    });
    const text = await fatalText(`${stand.host.address}/app/?bundle=../bundle/`);
    expect(text).toContain('manifest.json: found "<html>Sign in</html>", expected JSON');
  });

  it("reports on the page that the browser has no WebGL 2", async () => {
    await stand.viewer.page.addInitScript(() => {
      HTMLCanvasElement.prototype.getContext = () => null;
    });
    const text = await fatalText(`${stand.host.address}/app/?bundle=../bundle/`);
    expect(text).toContain("no WebGL 2");
  });

  it("names a broken or missing file in a notice and shows the rest", async () => {
    const { id } = stand.manifest.channels[0];
    const [{ id: tile }] = stand.manifest.tiles;
    stand.host.overrides.set(`/bundle/volumes/${tile}/${id}.ktx2`, { status: 404, body: "" });
    const lut = stand.manifest.channels[1].lut.path;
    stand.host.overrides.set(`/bundle/${lut}`, { status: 200, body: "not the file" });
    await stand.open("&mode=all");
    await stand.viewer.settled();
    const notices = stand.viewer.page.locator("[data-notices]");
    const text = await notices.textContent();
    expect(text).toContain(`volumes/${tile}/${id}.ktx2: not found (404)`);
    expect(text).toMatch(new RegExp(`${lut}: found 12 bytes, expected \\d+`));
    const picture = await takePicture(stand.viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    await notices.locator("p", { hasText: "(404)" }).getByRole("button").click();
    expect(await notices.textContent()).not.toContain("not found (404)");
  });

  it("draws no frames while nothing changes, and requests hardly any", async () => {
    await stand.open();
    await stand.viewer.settled();
    const frames = () => stand.viewer.page.evaluate(() => window.stereocell?.frames);
    const before = await frames();
    await stand.viewer.page.waitForTimeout(700); // frames go on for half a second after a change
    const requested = await stand.viewer.page.evaluate(async () => {
      const original = window.requestAnimationFrame;
      let count = 0;
      window.requestAnimationFrame = (draw) => {
        count++;
        return original(draw);
      };
      await new Promise((resolve) => setTimeout(resolve, 1000));
      window.requestAnimationFrame = original;
      return count;
    });
    expect(requested).toBeLessThanOrEqual(10);
    expect(await frames()).toBe(before);
  });
});
