/** What hands do on the picture: click, drag with the mouse, drag with a finger. */
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, expect, it } from "vitest";
import type { Manifest } from "../src/bundle/generated/bundle";
import { project } from "./driver/camera";
import { type Browser, launch } from "./driver/chromium";
import { Host } from "./driver/host";
import { ViewerPage } from "./driver/page";
import { difference, takePicture } from "./driver/picture";
import { describeInChromium } from "./driver/skip";
import { writeFixture } from "./fixture/bundle";

const DIST = new URL("../dist/", import.meta.url).pathname;
/** Of the picture's pixels: the specimen fills a good part of it. */
const TURNED = 0.02;

describeInChromium("hands on the picture", () => {
  let folder: string;
  let manifest: Manifest;
  let host: Host;
  let browser: Browser;
  let viewer: ViewerPage;

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-fixture-"));
    const given = process.env.STEREOCELL_TEST_BUNDLE;
    if (given === undefined) await writeFixture(folder);
    const bundle = given ?? folder;
    manifest = JSON.parse(await readFile(join(bundle, "manifest.json"), "utf8"));
    host = await Host.start({ "/": DIST, "/bundle/": bundle });
    browser = await launch({ width: 504, height: 240 }, { hasTouch: true });
  });

  afterAll(async () => {
    await browser?.close();
    await host?.stop();
    await rm(folder, { recursive: true, force: true });
  });

  beforeEach(async () => {
    viewer = new ViewerPage(await browser.context.newPage());
    await viewer.open(`${host.address}/?bundle=bundle/`);
    await viewer.settled();
  });

  afterEach(() => viewer.page.close());

  const tileNow = async () => (await viewer.snapshot()).state.tile;

  async function stageBox() {
    const box = await viewer.page.locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    return { ...box, middle: [box.x + box.width / 2, box.y + box.height / 2] as const };
  }

  it("opens at the tile nearest to the specimen's centre", async () => {
    const { specimen, tiles } = manifest;
    const center = ({ min, max }: Manifest["specimen"]["bounds_um"]) =>
      min.map((v, i) => (v + max[i]) / 2);
    const middle = center(specimen.bounds_um);
    const apart = (id: string) => {
      const tile = tiles.find((each) => each.id === id);
      if (tile === undefined) throw new Error(`no tile ${id}`);
      return Math.hypot(...center(tile.bounds_um).map((v, i) => v - middle[i]));
    };
    const nearest = Math.min(...tiles.map(({ id }) => apart(id)));
    expect(apart(await tileNow())).toBeCloseTo(nearest, 6);
  });

  it("choose exactly the tile under a click, wherever it lies", async () => {
    const start = await tileNow();
    const box = await stageBox();
    const others = manifest.tiles.filter(({ id }) => id !== start);
    for (const tile of [others[0], others[others.length - 1]]) {
      const { min, max } = tile.bounds_um;
      const front = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]] as const;
      const { x, y } = project(front, manifest.specimen.bounds_um, box.width, box.height);
      await viewer.page.mouse.click(box.x + x, box.y + y);
      expect(await tileNow()).toBe(tile.id);
    }
  });

  it("turn the specimen by dragging, which chooses nothing", async () => {
    const before = await takePicture(viewer.page);
    const start = await tileNow();
    const { middle, width } = await stageBox();
    await viewer.drag([middle[0] - width / 3, middle[1]], [middle[0], middle[1]]);
    expect(difference(before, await takePicture(viewer.page))).toBeGreaterThan(TURNED);
    expect(await tileNow()).toBe(start);
    await viewer.page.locator('[data-action="reset"]').click();
    await viewer.still();
    expect(difference(before, await takePicture(viewer.page))).toBeLessThan(TURNED / 10);
  });

  it("turn it by one finger", async () => {
    const before = await takePicture(viewer.page);
    const { middle, height } = await stageBox();
    const devtools = await viewer.page.context().newCDPSession(viewer.page);
    const touch = (type: "touchStart" | "touchMove" | "touchEnd", dx: number) =>
      devtools.send("Input.dispatchTouchEvent", {
        type,
        touchPoints: type === "touchEnd" ? [] : [{ x: middle[0] + dx, y: middle[1] }],
      });
    await touch("touchStart", 0);
    for (const share of [0.1, 0.2, 0.3]) await touch("touchMove", share * height);
    await touch("touchEnd", 0);
    await viewer.still();
    expect(difference(before, await takePicture(viewer.page))).toBeGreaterThan(TURNED);
  });

  it("find targets of 40 pixels where the pointer is a finger", async () => {
    await viewer.drawVolume(manifest.channels[0].id, true);
    const small = await viewer.page.evaluate(() => {
      const isShown = (e: Element) => e.getClientRects().length > 0;
      const selector = ".panel button, .panel select, .panel label, .panel input";
      const covered = "label input"; // the label around it is what is touched
      return [...document.querySelectorAll(selector)]
        .filter((e) => isShown(e) && !e.matches(covered))
        .map((e) => ({ text: e.outerHTML.slice(0, 80), box: e.getBoundingClientRect() }))
        .filter(({ box }) => Math.min(box.width, box.height) < 40)
        .map(({ text, box }) => `${text}: ${box.width} x ${box.height}`);
    });
    expect(small).toEqual([]);
  });
});
