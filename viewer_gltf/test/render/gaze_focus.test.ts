/** Representations: surfaces from afar, volumes around the gaze, in one tile, or everywhere. */
import { expect, it } from "vitest";
import type { Mode } from "../../src/state/parameters/volumes";
import { project } from "../support/browser/camera";
import { addClock, holdFrames, tick } from "../support/browser/clock";
import { isBackground, type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { IS_EXHAUSTIVE, sweep } from "../support/exhaustive";
import { BALLS } from "../support/fixture/bodies";

const VIEWPORT = { width: 480, height: 272 };
const FIELD_OF_VIEW_DEG = 40;
const DISC_DEG = 10;
const NEAR = "&switch=9";
/** Soft volumes are translucent, so they look different from the surfaces that they replace. */
const SOFT = "#v=1&depth=0&l=Balls:tsoft,F_x20_body:tsoft";

/**
 * Counts pixels of the disc's image against the images of its inside and its outside. `outside`: the
 * colour is beyond both by more than 5. `between`: it differs from both by more than 2.
 */
function rimOf(disc: Picture, within: Picture, without: Picture) {
  let [outside, between] = [0, 0];
  for (let y = 0; y < disc.height; y++) {
    for (let x = 0; x < disc.width; x++) {
      const [a, b, found] = [within.at(x, y), without.at(x, y), disc.at(x, y)];
      if (found.some((v, i) => v < Math.min(a[i], b[i]) - 5 || v > Math.max(a[i], b[i]) + 5))
        outside++;
      if (found.some((v, i) => Math.abs(v - a[i]) > 2 && Math.abs(v - b[i]) > 2)) between++;
    }
  }
  return { outside, between };
}

describeInChromium("a channel without a surface", () => {
  const stand = prepareStand({ viewport: VIEWPORT, fixture: { hasReason: true } });

  for (const quality of sweep(["high", "low"], (each) => each === "high")) {
    it(`is a volume on both sides of the rim, whose colours stay between both: ${quality}`, async () => {
      const at = async (query: string) => {
        await stand.open(`${query}&disc=${DISC_DEG}&quality=${quality}#v=1&depth=0`);
        await stand.viewer.settled();
        return takePicture(stand.viewer.page);
      };
      const disc = await at(`&mode=disc${NEAR}`);
      await stand.viewer.chooseMode("all");
      const within = await takePicture(stand.viewer.page);
      const without = await at("&mode=disc&switch=0.1");
      const shown = (await stand.viewer.snapshot()).volumes.map(({ channel }) => channel);
      expect(new Set(shown)).toEqual(new Set(["Block"]));
      const { outside, between } = rimOf(disc, within, without);
      expect(outside).toBe(0);
      expect(between).toBeGreaterThan(50);
    });
  }
});

describeInChromium("the representation of the specimen", () => {
  const stand = prepareStand({ viewport: VIEWPORT, pixelRatio: 1 });

  async function pictureOf(query: string): Promise<Picture> {
    await stand.open(query);
    await stand.viewer.settled();
    return takePicture(stand.viewer.page);
  }

  const modeAt = (mode: Mode, quality: string) =>
    `&mode=${mode}${NEAR}&disc=${DISC_DEG}&quality=${quality}`;

  /**
   * Images in several modes of a page that is opened once, since opening takes longer than drawing.
   */
  async function inModes(modes: readonly Mode[], quality: string, hash: string) {
    await stand.open(`${modeAt(modes[0], quality)}${hash}`);
    const pictures: Picture[] = [];
    for (const mode of modes) {
      await stand.viewer.chooseMode(mode);
      pictures.push(await takePicture(stand.viewer.page));
    }
    return pictures;
  }

  const drawn = new Map<Mode, Picture>();
  /**
   * Images with soft volumes, drawn once for all tests. The screen shows the last of the images that
   * this call had to draw.
   */
  async function as(...modes: Mode[]): Promise<Picture[]> {
    const missing = modes.filter((mode) => !drawn.has(mode));
    const made = missing.length > 0 ? await inModes(missing, "high", SOFT) : [];
    missing.forEach((mode, i) => {
      drawn.set(mode, made[i]);
    });
    return modes.flatMap((mode) => drawn.get(mode) ?? []);
  }

  /** Number of pixels in a ring around the middle that differ by more than `by`. */
  function apart(a: Picture, b: Picture, from_deg: number, to_deg: number, by = 2): number {
    const perTan = a.height / 2 / Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360);
    const [inner, outer] = [from_deg, to_deg].map(
      (deg) => perTan * Math.tan((deg * Math.PI) / 180),
    );
    let count = 0;
    for (let y = 0; y < a.height; y++) {
      for (let x = 0; x < a.width; x++) {
        const r = Math.hypot(x + 0.5 - a.width / 2, y + 0.5 - a.height / 2);
        if (r < inner || r > outer) continue;
        const other = b.at(x, y);
        if (a.at(x, y).some((v, i) => Math.abs(v - other[i]) > by)) count++;
      }
    }
    return count;
  }

  it("is a disc across the border of two tiles: volumes inside, surfaces outside", async () => {
    const [all, off, disc] = await as("all", "off", "disc");
    const { volumes, gazed, discRadius_deg } = await stand.viewer.snapshot();
    expect(discRadius_deg).toBeCloseTo(DISC_DEG, 5);
    expect(gazed).not.toBeNull();
    expect(new Set(volumes.map(({ tile }) => tile))).toEqual(new Set(["r0_c0", "r0_c1"]));
    const inner_deg = 0.55 * DISC_DEG;
    // Without this difference the test would prove nothing.
    expect(apart(all, off, 0, inner_deg, 20)).toBeGreaterThan(25);
    // the same image as with volumes everywhere, so no box edge shows
    expect(apart(disc, all, 0, inner_deg)).toBe(0);
    // a few pixels of silhouettes are multisampled differently where surfaces are blended
    expect(apart(disc, off, 1.04 * DISC_DEG, 40)).toBeLessThan(20);
    expect(apart(disc, off, 0.65 * DISC_DEG, 0.95 * DISC_DEG)).toBeGreaterThan(20); // the soft rim
  });

  for (const quality of ["high", "low"]) {
    it.runIf(IS_EXHAUSTIVE)(
      `has a rim whose colours stay between both images, quality ${quality}`,
      async () => {
        const [disc, all, off] = await inModes(["disc", "all", "off"], quality, "#v=1&depth=0");
        const { outside, between } = rimOf(disc, all, off);
        expect(outside).toBe(0);
        expect(between).toBeGreaterThan(50); // so there is a rim
      },
    );
  }

  it("changes colour in the same frame as surface and as volume", async () => {
    const { page } = stand.viewer;
    await addClock(page);
    await stand.open(`&mode=disc${NEAR}&disc=${DISC_DEG}&quality=high#v=1&c=Balls&depth=0`);
    await stand.viewer.settled();
    await stand.viewer.recolor("Balls", "#ff0000");
    expect((await stand.viewer.snapshot()).volumes.length).toBeGreaterThan(0);
    const count = async (channel: 0 | 1) =>
      (await takePicture(page)).count((pixel) => pixel[channel] > 40 + pixel[1 - channel]);
    const red = await count(0);
    expect(red).toBeGreaterThan(1000);
    await holdFrames(page);
    const { frames } = await page.evaluate(() => ({ frames: window.stereocell?.frames }));
    await page.locator('[data-channel="Balls"] [data-part="color"]').fill("#00ff00");
    await tick(page, 16);
    expect(await page.evaluate(() => window.stereocell?.frames)).toBe((frames ?? 0) + 1);
    expect(await count(0)).toBe(0);
    expect(Math.abs((await count(1)) - red)).toBeLessThan(red / 20);
  });

  it("is drawn in lower quality while frames are late, and in full quality at rest", async () => {
    const { page } = stand.viewer;
    await addClock(page);
    await stand.open(`&mode=all${NEAR}&quality=auto#v=1&depth=0`);
    await stand.viewer.settled();
    const settings = async () => (await stand.viewer.snapshot()).settings;
    const best = await settings();
    expect(best).toMatchObject({ steps: 100, resolution: 1 });
    await holdFrames(page);
    for (let i = 0; i < 60 && (await settings()).resolution === 1; i++) {
      await page.keyboard.press("ArrowLeft");
      await tick(page, 150);
    }
    const moving = await settings();
    expect(moving.steps).toBeLessThan(100);
    expect(moving.resolution).toBeLessThan(1);
    // data that arrive fade in, which counts as movement
    const isLoading = async () => {
      await tick(page, 150);
      return (await stand.viewer.snapshot()).isLoading;
    };
    await expect.poll(isLoading).toBe(false);
    await tick(page, 150, 8);
    expect(await settings()).toEqual(best);
    // the noise averages out frame by frame while nothing changes
    const frames = () => page.evaluate(() => window.stereocell?.frames ?? 0);
    const rested = await frames();
    const later = async () => {
      await tick(page, 2000);
      return frames();
    };
    await expect.poll(later).toBeGreaterThan(rested + 2);
  });

  it("stays a surface beyond the volume distance", async () => {
    await stand.open("&switch=1");
    await stand.viewer.settled();
    const before = await stand.viewer.snapshot();
    expect(before.volumes).toEqual([]);
    expect(before.discRadius_deg).toBe(0);
    const asked = stand.host.requests.filter(({ path }) => path.includes("/volumes/"));
    expect(asked).toEqual([]);
    const box = await stand.viewer.page.locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    await stand.viewer.page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    for (let i = 0; i < 12; i++) await stand.viewer.page.mouse.wheel(0, -120);
    await stand.viewer.still();
    const near = await stand.viewer.snapshot();
    expect(near.volumes.length).toBeGreaterThan(0);
    expect(near.discRadius_deg).toBeGreaterThan(0);
  });

  it("is a volume in exactly the gazed tile in the paper's mode", async () => {
    const [all, off, tile] = await as("all", "off", "tile");
    const { volumes, gazed } = await stand.viewer.snapshot();
    expect(new Set(volumes.map((each) => each.tile))).toEqual(new Set([gazed]));
    const { specimen } = stand.manifest;
    const other = gazed === "r0_c0" ? BALLS[0] : BALLS[1];
    const own = gazed === "r0_c0" ? BALLS[1] : BALLS[0];
    const at = (picture: Picture, { center }: (typeof BALLS)[number]) => {
      const { x, y } = project(center, specimen.bounds_um, picture.width, picture.height);
      return picture.at(x, y);
    };
    expect(at(tile, other)).toEqual(at(off, other));
    expect(at(tile, own)).not.toEqual(at(off, own));
    at(tile, own).forEach((v, i) => {
      // The steps of the ray are distributed differently.
      expect(Math.abs(v - at(all, own)[i])).toBeLessThanOrEqual(8);
    });
  });

  it("uploads one small table for another appearance, never a volume", async () => {
    await stand.viewer.page.addInitScript(() => {
      const uploads: number[] = [];
      (window as unknown as { uploads: number[] }).uploads = uploads;
      const { prototype } = WebGL2RenderingContext;
      for (const name of ["texImage3D", "texSubImage3D", "texSubImage2D", "texImage2D"] as const) {
        const original = prototype[name] as (...given: unknown[]) => void;
        Object.assign(prototype, {
          [name](this: WebGL2RenderingContext, ...given: unknown[]) {
            const data = given.find((each) => ArrayBuffer.isView(each));
            uploads.push(ArrayBuffer.isView(data) ? data.byteLength : 0);
            return original.apply(this, given);
          },
        });
      }
    });
    await stand.open(`&mode=all#v=1&depth=0`);
    await stand.viewer.settled();
    const take = () =>
      stand.viewer.page.evaluate(() =>
        (window as unknown as { uploads: number[] }).uploads.splice(0),
      );
    expect(Math.max(...(await take()))).toBeGreaterThan(100_000);
    await stand.viewer.chooseTransferFunction("Block", "soft");
    const asked = () =>
      stand.host.requests.filter(({ path }) => path.startsWith("/bundle/")).length;
    const requests = asked();
    const tables = await take();
    expect(tables.length).toBeGreaterThan(0);
    // rows of the lookup table, and the empty-space table
    expect(Math.max(...tables)).toBeLessThanOrEqual(4 * 1024);
    await stand.viewer.recolor("Block", "#ff00ff");
    expect((await take()).filter((bytes) => bytes > 0)).toEqual([]);
    expect(asked()).toBe(requests);
    // other shading needs one coarse grid, computed from loaded data
    await stand.viewer.slide("depth-shading", 0.5);
    expect(Math.max(...(await take()))).toBeLessThanOrEqual(2 * 64 ** 3);
    await stand.viewer.chooseTransferFunction("Block", "default");
    const shaded = await take();
    expect(Math.max(...shaded)).toBeGreaterThan(4 * 1024);
    expect(Math.max(...shaded)).toBeLessThanOrEqual(2 * 64 ** 3);
    expect(asked()).toBe(requests);
  });

  it("is shaded by surrounding and occluding matter, equally in each run", async () => {
    const open = (depth: number) => pictureOf(`${modeAt("all", "high")}#v=1&depth=${depth}`);
    const slide = async (depth: number) => {
      await stand.viewer.slide("depth-shading", depth);
      return takePicture(stand.viewer.page);
    };
    const [none, half, whole] = [await open(0), await slide(0.5), await slide(1)];
    const again = await open(1);
    expect(apart(whole, again, 0, 90, 0)).toBe(0);
    const mean = (picture: Picture) => {
      const drawn = picture.where((pixel) => !isBackground(pixel));
      return drawn.reduce((sum, place) => sum + picture.at(...place)[1], 0) / drawn.length;
    };
    expect(mean(whole)).toBeLessThan(mean(half));
    expect(mean(half)).toBeLessThan(mean(none) + 2); // open places are slightly brighter
    expect(mean(whole)).toBeGreaterThan(0.7 * mean(none));
  });

  it("is lit like the surfaces beside it in a disc, at any depth shading", async () => {
    const disc = (depth: number) => pictureOf(`${modeAt("disc", "high")}#v=1&depth=${depth}`);
    expect(apart(await disc(1), await disc(0), 0, 90, 0)).toBe(0);
  });

  it("looks similar with fewer pixels and steps", async () => {
    const blockAt = async (quality: string) => {
      await stand.open(`&mode=all&quality=${quality}#v=1&c=Block`);
      await stand.viewer.settled();
      return takePicture(stand.viewer.page);
    };
    const [high, low] = [await blockAt("high"), await blockAt("low")];
    const { settings } = await stand.viewer.snapshot();
    expect(settings.resolution).toBeLessThanOrEqual(0.5);
    expect(settings.steps).toBeLessThan(100);
    const pixels = VIEWPORT.width * VIEWPORT.height;
    expect(apart(high, low, 0, 40)).toBeGreaterThan(0); // the images differ
    expect(apart(high, low, 0, 40, 20)).toBeLessThan(0.01 * pixels); // at outlines
    // nothing is shifted: the middle of the drawn part stays in place
    const middle = (picture: Picture) => {
      const drawn = picture.where((pixel) => !isBackground(pixel));
      return [0, 1].map((i) => drawn.reduce((sum, at) => sum + at[i], 0) / drawn.length);
    };
    const [a, b] = [middle(high), middle(low)];
    expect(Math.hypot(a[0] - b[0], a[1] - b[1])).toBeLessThan(0.7);
  });

  it("cancels requests that are no longer wanted", async () => {
    await stand.open(`&mode=tile${NEAR}`);
    await stand.viewer.settled();
    stand.host.delay_ms = 2500;
    const aborted: string[] = [];
    stand.viewer.page.on("requestfailed", (request) => aborted.push(request.url()));
    const [one, other] = stand.manifest.tiles.map(({ id }) => id);
    const { gazed } = await stand.viewer.snapshot();
    const next = gazed === one ? other : one;
    await stand.viewer.page.locator(`[data-tile-choice="${next}"]`).click();
    await stand.viewer.page.waitForTimeout(500);
    await stand.viewer.page.locator("select[data-mode]").selectOption("off");
    await expect.poll(() => aborted.some((url) => url.includes(`/volumes/${next}/`))).toBe(true);
    expect((await stand.viewer.snapshot()).state.notices).toEqual([]);
  });
});
