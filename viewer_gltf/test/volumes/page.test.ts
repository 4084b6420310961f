/**
 * How volumes are loaded: a coarse level first, a finer one where the gaze rests, without a jump
 * between them.
 */
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { expect, it } from "vitest";
import type { TileVolume } from "../../src/bundle/generated/volumes";
import type { VolumeStatus } from "../../src/render/drawn_forms";
import { addClock, holdFrames, tick } from "../support/browser/clock";
import { isBackground, type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";

/**
 * Levels of the fixture's volumes: the first is the finest one within 64 KiB, the last is the full
 * volume.
 */
const [FIRST, FINEST] = [1, 0];
const PATIENT = { timeout: 120_000 };

/** Mean difference between two images, of 255. */
function apart(a: Picture, b: Picture): number {
  let sum = 0;
  for (let y = 0; y < a.height; y++) {
    for (let x = 0; x < a.width; x++) {
      const other = b.at(x, y);
      a.at(x, y).forEach((v, i) => {
        sum += Math.abs(v - other[i]);
      });
    }
  }
  return sum / (3 * a.width * a.height);
}

describeInChromium("volumes", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 270 }, pixelRatio: 1 });
  const page = () => stand.viewer.page;
  const volumes = async () => (await stand.viewer.snapshot()).volumes;
  const areAt = (found: readonly VolumeStatus[], level: number) =>
    found.length > 0 && found.every((each) => each.level === level);

  /** All volumes of the bundle. */
  async function listed(): Promise<readonly TileVolume[]> {
    const lists = stand.manifest.channels.map(async (channel) => {
      const text = await readFile(join(stand.bundle, channel.volumes.path), "utf8");
      return (JSON.parse(text) as { volumes: TileVolume[] }).volumes;
    });
    return (await Promise.all(lists)).flat();
  }

  /** Requested levels of each volume, in the order of the requests. */
  async function asked(): Promise<ReadonlyMap<string, readonly number[]>> {
    const byPath = new Map<string, readonly number[]>();
    for (const { file, levels } of await listed()) {
      const ranges = stand.host.requests
        .filter(({ path }) => path === `/bundle/${file.path}`)
        .map(({ range }) => range);
      const found = ranges.map((range) =>
        levels.findIndex(
          ({ offset, length }) => range === `bytes=${offset}-${offset + length - 1}`,
        ),
      );
      byPath.set(file.path, found);
    }
    return byPath;
  }

  /** Delays the answers for a level until the returned function is called. */
  async function holdBack(level: number): Promise<() => void> {
    let release = () => {};
    const gate = new Promise<void>((open) => {
      release = open;
    });
    const starts = new Map((await listed()).map(({ file, levels }) => [file.path, levels[level]]));
    await page().route(/\/bundle\/volumes\//, async (route, request) => {
      const path = new URL(request.url()).pathname.replace("/bundle/", "");
      const range = await request.headerValue("range");
      const { offset } = starts.get(path) ?? { offset: -1 };
      if (range?.startsWith(`bytes=${offset}-`)) await gate;
      await route.continue().catch(() => undefined); // the page may be closed already
    });
    return release;
  }

  it("are loaded coarse first: all tiles are shown before any is complete", async () => {
    const release = await holdBack(FINEST);
    await stand.open("&mode=all");
    const total = stand.manifest.tiles.length * stand.manifest.channels.length;
    await expect.poll(async () => areAt(await volumes(), FIRST), PATIENT).toBe(true);
    expect(await volumes()).toHaveLength(total);
    const coarse = await stand.viewer.snapshot();
    expect(coarse.isLoading).toBe(true);
    await expect
      .poll(async () => (await takePicture(page())).count((p) => !isBackground(p)), PATIENT)
      .toBeGreaterThan(5000);
    release();
    await stand.viewer.settled();
    expect(areAt(await volumes(), FINEST)).toBe(true);
    expect((await stand.viewer.snapshot()).volumeBytes).toBeGreaterThan(4 * coarse.volumeBytes);
    const levels = await asked();
    expect(levels.size).toBe(total);
    for (const [path, found] of levels) expect(found, path).toEqual([FIRST, FINEST]);
  });

  it("are refined where the gaze rests, but not while it wanders", async () => {
    await addClock(page());
    await stand.open("&mode=off&switch=9&quality=low");
    await stand.viewer.settled();
    await holdFrames(page());
    await page().keyboard.press("ArrowLeft");
    const gazed = new Set<string | null>();
    /** Looks from one tile to the other and back, long enough to focus a tile but not to rest. */
    const wander = async () => {
      for (const key of ["ArrowRight", "ArrowLeft"]) {
        for (let i = 0; i < 2; i++) await page().keyboard.press(key); // across the tiles' border
        await tick(page(), 50, 5);
        gazed.add((await stand.viewer.snapshot()).gazed);
      }
    };
    await wander();
    await page().locator("select[data-mode]").selectOption("disc");
    // The menu must not take the keys.
    await page().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await expect
      .poll(async () => {
        await wander();
        return areAt(await volumes(), FIRST);
      }, PATIENT)
      .toBe(true);
    const shown = new Set((await volumes()).map(({ tile }) => tile));
    expect(shown).toEqual(new Set(stand.manifest.tiles.map(({ id }) => id)));
    for (let i = 0; i < 5; i++) {
      await wander();
      await page().waitForTimeout(200); // a requested level would have arrived
    }
    expect(gazed).toEqual(shown); // the gaze did wander
    expect(areAt(await volumes(), FIRST)).toBe(true);
    for (const [path, found] of await asked()) expect(found, path).toEqual([FIRST]);

    await expect
      .poll(async () => {
        await tick(page(), 50, 5);
        return areAt(await volumes(), FINEST);
      }, PATIENT)
      .toBe(true);
    for (const [path, found] of await asked()) expect(found, path).toEqual([FIRST, FINEST]);
  });

  it.runIf(IS_EXHAUSTIVE)(
    "have disappeared in the frame after one that took longer than the fade",
    async () => {
      await addClock(page());
      await stand.open("&mode=off&switch=9&quality=high");
      await stand.viewer.settled();
      const surfaces = await takePicture(page());
      await stand.viewer.chooseMode("all");
      const drawn = await takePicture(page());
      expect(apart(drawn, surfaces)).toBeGreaterThan(0.5);
      await holdFrames(page());
      await page().locator("select[data-mode]").selectOption("off");
      await tick(page(), 16);
      await tick(page(), 1800); // a very slow device
      expect(apart(await takePicture(page()), surfaces)).toBeLessThan(0.02);
    },
  );

  it("are faded from one level to the next", async () => {
    await addClock(page());
    const release = await holdBack(FINEST);
    await stand.open("&mode=off&quality=high");
    await stand.viewer.settled();
    await holdFrames(page());
    await page().locator("select[data-mode]").selectOption("all");
    await expect
      .poll(async () => {
        await tick(page(), 100, 5);
        return areAt(await volumes(), FIRST);
      }, PATIENT)
      .toBe(true);
    await tick(page(), 100, 10);
    for (let i = 0; i < 2; i++) await tick(page(), 2000); // nothing more is being drawn
    const coarse = await takePicture(page());
    const { volumeBytes: coarseBytes } = await stand.viewer.snapshot();
    release();
    // No frame has been drawn yet.
    await expect.poll(async () => areAt(await volumes(), FINEST), PATIENT).toBe(true);

    const frames = async () => (await page().evaluate(() => window.stereocell?.frames)) ?? 0;
    const bytes: number[] = [];
    const pictures: Picture[] = [];
    for (let i = 0; i < 6; i++) {
      const before = await frames();
      await tick(page(), 40); // a fifth of the fade
      const isDrawn = async () => {
        await tick(page(), 0.1); // when the last image is done
        return (await frames()) > before;
      };
      if (i < 5) await expect.poll(isDrawn, PATIENT).toBe(true);
      pictures.push(await takePicture(page()));
      bytes.push((await stand.viewer.snapshot()).volumeBytes);
    }
    const fine = pictures[pictures.length - 1];
    const away = [coarse, ...pictures].map((each) => apart(each, fine));
    expect(away[0]).toBeGreaterThan(0.5);
    for (let i = 1; i < 5; i++) {
      expect(away[i], `frame ${i}`).toBeLessThan(away[i - 1]);
      expect(away[i - 1] - away[i], `frame ${i}`).toBeLessThan(0.5 * away[0]);
    }
    expect(away[5]).toBeLessThan(0.02 * away[0]);
    // two levels are kept while they are mixed, then only the new one
    expect(bytes.slice(0, 4)).toEqual(new Array(4).fill(coarseBytes + bytes[5]));
  });
});
