/**
 * Correct stereo in a headset: a known point of a surface, a volume or a slice lies in each eye's
 * image where the geometry of that eye puts it.
 */
import { expect, it } from "vitest";
import { place, XR_DISTANCE_M } from "../../src/render/placement";
import { addHeadset } from "../support/browser/chromium";
import { isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";
import { BALLS } from "../support/fixture/bodies";

const VIEWPORT = { width: 480, height: 240 };
/** Metres between the pupils; iwer's default for the emulated headset. */
const PUPILS_M = 0.063;
const FIELD_OF_VIEW_RAD = Math.PI / 2;

const HALF_PX = VIEWPORT.width / 2;
const FOCAL_PX = VIEWPORT.height / 2 / Math.tan(FIELD_OF_VIEW_RAD / 2);
const EYES = [
  [0, -1],
  [HALF_PX, 1],
] as const;

describeInChromium("correct stereo", () => {
  const stand = prepareStand({ viewport: VIEWPORT, pixelRatio: 1 });

  const pictureOf = (left: number) =>
    takePicture(stand.viewer.page, { x: left, y: 0, width: HALF_PX, height: VIEWPORT.height });

  it("hides volumes behind surfaces, and surfaces behind volumes, for both eyes", async () => {
    await addHeadset(stand.viewer.page);
    await stand.open("&mode=all&quality=high#v=1&depth=0");
    await stand.viewer.showOnly();
    await stand.viewer.showAs("Block", "volume");
    await stand.viewer.show("Block", false);
    await stand.viewer.showAs("Balls", "surface");
    await stand.viewer.enterStereo();
    const { scale, center } = place(stand.manifest.specimen.bounds_um);
    const look = async () => {
      await stand.viewer.settled();
      const found = [];
      for (const [left, side] of EYES) {
        const eye = await pictureOf(left);
        for (const ball of [BALLS[2], BALLS[3]]) {
          // the point of the ball nearest to the eyes' plane
          const [x, y, z] = ball.center.map((v, i) => (v - center[i]) * scale);
          const perMetre = FOCAL_PX / (XR_DISTANCE_M - z - ball.radius * scale);
          const px = HALF_PX / 2 + perMetre * (x - (side * PUPILS_M) / 2);
          found.push(eye.at(Math.round(px), Math.round(VIEWPORT.height / 2 - perMetre * y)));
        }
      }
      return found;
    };
    const bare = await look();
    const block = stand.manifest.channels.findIndex(({ id }) => id === "Block");
    await stand.viewer.page.keyboard.press(String(block + 1));
    const veiled = await look();
    for (const eye of [0, 2]) {
      expect(veiled[eye]).toEqual(bare[eye]);
      expect(veiled[eye + 1][1]).toBeGreaterThan(bare[eye + 1][1] + 20);
      expect(veiled[eye + 1][2]).toBeLessThan(bare[eye + 1][2] - 20);
    }
  });

  it("puts a slice where both eyes should see it, across the whole specimen", async () => {
    const { viewer } = stand;
    const at = 0.9; // share of the specimen's depth, in front of most of it
    await addHeadset(viewer.page);
    await stand.open(`&mode=off&quality=high#v=1&slice-z=${at}`);
    await viewer.enterStereo();
    await viewer.settled();
    const look = () => Promise.all(EYES.map(([left]) => pictureOf(left)));
    const without = await look();
    await viewer.page.keyboard.press("|");
    await viewer.settled();
    await expect.poll(async () => (await viewer.snapshot()).stereoNotices.length).toBe(0);
    const shown = await look();
    const { scale, center } = place(stand.manifest.specimen.bounds_um);
    const { min, max } = stand.manifest.specimen.bounds_um;
    const depth = XR_DISTANCE_M - (min[2] + at * (max[2] - min[2]) - center[2]) * scale;
    const perMetre = FOCAL_PX / depth;
    const columns = EYES.map(([, side], i) => {
      // Pixels are compared at 1/4 and 3/4 of the slice's height, where it has no lines or letters.
      const [a, b] = [shown[i], without[i]];
      const differs = (x: number, y: number) =>
        a.at(x, y).some((v, k) => Math.abs(v - b.at(x, y)[k]) > 8);
      const rows = [0.25, 0.75].map((share) => {
        const y = min[1] + share * (max[1] - min[1]) - center[1];
        return Math.round(VIEWPORT.height / 2 - perMetre * y * scale);
      });
      const found = Array.from({ length: HALF_PX }, (_, x) => x).filter((x) =>
        rows.some((row) => differs(x, row)),
      );
      const wanted = [min[0], max[0]].map(
        (x) => HALF_PX / 2 + perMetre * ((x - center[0]) * scale - (side * PUPILS_M) / 2),
      );
      return { found, wanted };
    });
    const ends = columns.map(({ found, wanted }) => {
      const [left, right] = [found[0], (found.at(-1) ?? 0) + 1];
      expect(Math.abs(left - wanted[0])).toBeLessThan(1.5);
      expect(Math.abs(right - wanted[1])).toBeLessThan(1.5);
      return (left + right) / 2;
    });
    expect(Math.abs(ends[0] - ends[1] - perMetre * PUPILS_M)).toBeLessThan(1);
  });

  const drawn = [
    ["surface", "&mode=off"],
    ["volume", "&mode=all"],
    ["disc", "&mode=disc&switch=9&disc=40"],
  ] as const;
  for (const [as, query] of sweep(drawn, ([as]) => as === "volume")) {
    it(`puts a ball's middle where both eyes should see it, as a ${as}`, async () => {
      await addHeadset(stand.viewer.page);
      await stand.open(`${query}&quality=high#v=1&c=Balls&depth=0`);
      await stand.viewer.enterStereo();
      await stand.viewer.settled();

      const { scale, center } = place(stand.manifest.specimen.bounds_um);
      const [{ center: ball, radius }] = BALLS;
      const [x, y, z] = ball.map((v, i) => (v - center[i]) * scale);
      const depth = XR_DISTANCE_M - z;
      // the middle of a ball's outline lies slightly farther out than the image of its centre
      const perMetre = (FOCAL_PX * depth) / (depth ** 2 - (radius * scale) ** 2);
      const around_px = (1.3 * radius * scale * FOCAL_PX) / depth;

      const found = [];
      for (const [left, side] of EYES) {
        const eye = await pictureOf(left);
        const wanted_px = HALF_PX / 2 + perMetre * (x - (side * PUPILS_M) / 2);
        const row_px = VIEWPORT.height / 2 - perMetre * y;
        const drawn = eye
          .where((pixel) => !isBackground(pixel))
          .filter(([px, py]) => Math.hypot(px - wanted_px, py - row_px) < around_px);
        expect(drawn.length).toBeGreaterThan(100);
        const middle_px = drawn.reduce((sum, [px]) => sum + px + 0.5, 0) / drawn.length;
        expect(Math.abs(middle_px - wanted_px)).toBeLessThan(1);
        found.push(middle_px);
      }
      const disparity_px = found[0] - found[1];
      expect(Math.abs(disparity_px - perMetre * PUPILS_M)).toBeLessThan(1);
    });
  }
});
