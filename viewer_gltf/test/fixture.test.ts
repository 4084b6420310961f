/** Numbers out of the picture, on bodies whose look can be written down. */
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, expect, it } from "vitest";
import type { Manifest } from "../src/bundle/generated/bundle";
import { project } from "./driver/camera";
import { type Browser, launch } from "./driver/chromium";
import { Host } from "./driver/host";
import { ViewerPage } from "./driver/page";
import { isBackground, type Picture, type Pixel, takePicture } from "./driver/picture";
import { describeInChromium } from "./driver/skip";
import { BALLS, BLOCK } from "./fixture/bodies";
import { BLOCK_OPACITY, writeFixture } from "./fixture/bundle";
import { FIXTURE_LETTER } from "./fixture/letter";
import { SPACING } from "./fixture/volumes";
import { expectLetter } from "./letter";

const DIST = new URL("../dist/", import.meta.url).pathname;
const F = "F_x20_body";

describeInChromium("the picture of the fixture", () => {
  let folder: string;
  let manifest: Manifest;
  let host: Host;
  let browser: Browser;
  let viewer: ViewerPage;

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-fixture-"));
    manifest = await writeFixture(folder);
    host = await Host.start({ "/": DIST, "/bundle/": folder });
    browser = await launch({ width: 704, height: 400 });
  });

  afterAll(async () => {
    await browser?.close();
    await host?.stop();
    await rm(folder, { recursive: true, force: true });
  });

  beforeEach(async () => {
    viewer = new ViewerPage(await browser.context.newPage());
    await viewer.open(`${host.address}/?bundle=bundle/`);
    for (const { id } of manifest.channels) await viewer.show(id, false);
  });

  afterEach(() => viewer.page.close());

  function at(picture: Picture, point: readonly [number, number, number]): Pixel {
    const { x, y } = project(point, manifest.specimen.bounds_um, picture.width, picture.height);
    return picture.at(x, y);
  }

  const showAsVolume = (id: string) => viewer.showAs(id, "volume");

  for (const as of ["surface", "volume"] as const) {
    it(`shows the F as a ${as} neither mirrored nor turned`, () =>
      expectLetter(viewer, manifest, F, as, FIXTURE_LETTER));
  }

  it("draws a uniform block as opaque as its length says", async () => {
    await showAsVolume("Block");
    await viewer.recolor("Block", "#ffffff");
    const picture = await takePicture(viewer.page);
    const point = [56, -42, 12] as const;
    const { cosine } = project(point, manifest.specimen.bounds_um, picture.width, picture.height);
    const length = (BLOCK.max[2] - BLOCK.min[2]) / cosine;
    const voxels = length / Math.min(...SPACING);
    const expected = 1 - (1 - BLOCK_OPACITY / 255) ** voxels;
    const [red] = at(picture, point);
    const background = 11;
    expect((red - background) / (255 - background)).toBeCloseTo(expected, 1.5);
  });

  it("lets surfaces hide volumes behind them, and volumes veil surfaces", async () => {
    await viewer.show("Balls", true);
    const inFront = at(await takePicture(viewer.page), BALLS[2].center);
    const behind = at(await takePicture(viewer.page), BALLS[3].center);
    await showAsVolume("Block");
    const veiled = await takePicture(viewer.page);
    expect(at(veiled, BALLS[2].center)).toEqual(inFront);
    const [, green, blue] = at(veiled, BALLS[3].center);
    expect(green).toBeGreaterThan(behind[1] + 20); // the block's green over the ball's blue
    expect(blue).toBeLessThan(behind[2] - 20);
  });

  it("shows less through a softer transfer function", async () => {
    await showAsVolume("Block");
    const point = [56, -42, 12] as const;
    const normal = at(await takePicture(viewer.page), point);
    await viewer.chooseTransferFunction("Block", "soft");
    const soft = at(await takePicture(viewer.page), point);
    expect(soft[1]).toBeLessThan(normal[1] - 20);
    expect(isBackground(soft)).toBe(false);
  });
});
