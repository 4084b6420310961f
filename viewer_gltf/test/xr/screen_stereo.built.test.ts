/** Stereo on the page's own screen: points lie where two eyes see them, and greys stay grey. */
import { readFile } from "node:fs/promises";
import { expect, it } from "vitest";
import { place } from "../../src/render/placement";
import {
  difference,
  isBackground,
  Picture,
  type Pixel,
  takePicture,
} from "../support/browser/picture";
import { decodePng } from "../support/browser/png";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { colorDifference, toLab } from "../support/color_difference";
import { BALLS } from "../support/fixture/bodies";

const VIEWPORT = { width: 640, height: 300 };
/** Metres, straight in front, so that a ball's distance is its depth. */
const EYE_M = 1.8;
const LINK = `#v=1&depth=0&eye=0,0,${EYE_M},0,0,0`;
const PUPILS_M = 0.063;
const FIELD_OF_VIEW_RAD = (40 * Math.PI) / 180;

describeInChromium("stereo on the screen", () => {
  const stand = prepareStand({ viewport: VIEWPORT, pixelRatio: 1 });

  const openSideBySide = async () => {
    await stand.open(`&mode=off&stereo=side-by-side${LINK}`);
    // its code is loaded after the first frame
    await stand.viewer.page.waitForFunction(() =>
      performance.getEntriesByType("resource").some(({ name }) => name.includes("screen_stereo")),
    );
    await stand.viewer.settled();
  };

  const eyesOf = async () => {
    const box = await stand.viewer.page.locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    const half = { y: box.y, width: Math.floor(box.width / 2), height: box.height };
    const left = await takePicture(stand.viewer.page, { ...half, x: box.x });
    const right = await takePicture(stand.viewer.page, { ...half, x: box.x + half.width });
    return { left, right, ...half };
  };

  /** Mean column of the lit pixels in the rows around y, among the columns around x. */
  function middleOf(picture: Picture, [x, y]: readonly [number, number], reach_px: number): number {
    const isLit = (at: readonly [number, number]) =>
      Math.abs(at[0] - x) < reach_px &&
      Math.abs(at[1] - y) < reach_px / 3 &&
      Math.max(...picture.at(...at)) > 60;
    const found = picture.where(() => true).filter(isLit);
    return found.reduce((sum, [column]) => sum + column, 0) / found.length;
  }

  it("shows a ball in both images with the parallax of two eyes, and Escape leaves stereo", async () => {
    const { viewer } = stand;
    await openSideBySide();
    await viewer.showOnly("Balls");
    const { left, right, width, height } = await eyesOf();
    const { scale, center } = place(stand.manifest.specimen.bounds_um);
    const focal_px = height / 2 / Math.tan(FIELD_OF_VIEW_RAD / 2);
    for (const ball of BALLS.slice(0, 2)) {
      const [x, y, z] = ball.center.map((v, i) => (v - center[i]) * scale);
      const distance_m = EYE_M - z;
      const at = [
        width / 2 + (focal_px * x) / distance_m,
        height / 2 - (focal_px * y) / distance_m,
      ] as const;
      const reach_px = (2 * focal_px * ball.radius * scale) / distance_m;
      const apart_px = middleOf(left, at, reach_px) - middleOf(right, at, reach_px);
      const expected_px = focal_px * PUPILS_M * (1 / distance_m - 1 / EYE_M);
      expect(Math.abs(apart_px - expected_px), `${apart_px}, ${expected_px}`).toBeLessThan(0.7);
    }
    expect(await viewer.page.locator(".scale-bar").isVisible()).toBe(false);
    await viewer.page.keyboard.press("Escape");
    await expect.poll(async () => (await viewer.snapshot()).state.screenStereo).toBe("off");
    expect(await viewer.page.locator(".scale-bar").isVisible()).toBe(true);
  });

  it("saves both images as the screen shows them, and keeps showing them", async () => {
    const { viewer } = stand;
    await openSideBySide();
    await viewer.settled();
    const before = await takePicture(viewer.page);
    await viewer.unfold("save");
    const saving = viewer.page.waitForEvent("download");
    await viewer.page.locator('[data-action="save-picture"]').click();
    const { width, height, rgba } = decodePng(await readFile(await (await saving).path()));
    const saved = new Picture(width, height, rgba);
    await viewer.settled();
    expect([width, height]).toEqual([before.width, before.height]);
    expect(saved.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    expect(difference(saved, before)).toBeLessThan(0.03);
    expect(difference(await takePicture(viewer.page), before)).toBeLessThan(0.01);
  });

  it("chooses the tile that is clicked in either eye's image", async () => {
    const { viewer } = stand;
    await openSideBySide();
    await viewer.settled();
    const box = await viewer.page.locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    const selected = async () => (await viewer.snapshot()).state.selected;
    const found = [];
    for (const share of [0.25, 0.75]) {
      // slightly to the left of each image's middle
      await viewer.clickOnce(box.x + share * box.width - 0.06 * box.width, box.y + box.height / 2);
      found.push(await selected());
      await viewer.page.keyboard.press("g"); // clears the choice of the click before
      await viewer.clickOnce(box.x + 2, box.y + 2);
    }
    expect(found[0]).toBe("r0_c0");
    expect(found[1]).toBe(found[0]);
  });

  it("keeps a grey specimen grey in an anaglyph with both eyes in one place", async () => {
    const { viewer } = stand;
    await stand.open(`&mode=off${LINK}`);
    await viewer.showOnly("Balls");
    await viewer.recolor("Balls", "#c8c8c8");
    const flat = await takePicture(viewer.page);
    await viewer.unfold("stereo");
    await viewer.page.locator('[data-control="screen-stereo"]').selectOption("anaglyph");
    // at full strength, the rims of a ball are red on one side and cyan on the other
    const isRed = ([r, g, b]: Pixel) => r > 40 && r > 2 * Math.max(g, b);
    const isCyan = ([r, g, b]: Pixel) => Math.min(g, b) > 40 && Math.min(g, b) > 2 * r;
    const rims = async () => {
      const picture = await takePicture(viewer.page);
      return Math.min(picture.count(isRed), picture.count(isCyan));
    };
    await expect.poll(rims).toBeGreaterThan(20); // the code must be loaded first
    await viewer.slide("stereo-strength", 0);
    const alike = await takePicture(viewer.page);
    const differences = (a: Picture, b: Picture) => {
      const lit = a.where((pixel) => Math.max(...pixel) > 60);
      const all = lit.map(([x, y]) => colorDifference(toLab(a.at(x, y)), toLab(b.at(x, y))));
      return all.sort((one, other) => one - other);
    };
    const same = differences(flat, alike);
    expect(same.length).toBeGreaterThan(500);
    expect(same.reduce((sum, each) => sum + each, 0) / same.length).toBeLessThan(2);
    expect(same[Math.floor(0.99 * same.length)]).toBeLessThan(4);
  });
});
