/** Stereo that is right: a known point lies where the two eyes' geometry says, drawn either way. */
import { expect, it } from "vitest";
import { place, XR_DISTANCE_M } from "../src/view/placement";
import { addHeadset } from "./driver/chromium";
import { isBackground, takePicture } from "./driver/picture";
import { describeInChromium } from "./driver/skip";
import { prepareStand } from "./driver/stand";
import { BALLS } from "./fixture/bodies";

const VIEWPORT = { width: 1000, height: 500 };
/** Of the emulated headset: what iwer gives by default. */
const PUPILS_M = 0.063;
const FIELD_OF_VIEW_RAD = Math.PI / 2;

describeInChromium("in stereo", () => {
  const stand = prepareStand({ viewport: VIEWPORT });

  for (const [as, query] of [
    ["surface", "&mode=off"],
    ["volume", "&mode=all"],
    ["disc", "&mode=disc&switch=9&disc=40"],
  ] as const) {
    it(`a ball's middle lies where both eyes should see it, as a ${as}`, async () => {
      await addHeadset(stand.viewer.page);
      await stand.open(`${query}&quality=high`);
      for (const { id } of stand.manifest.channels) await stand.viewer.show(id, id === "Balls");
      await stand.viewer.enterStereo();
      await stand.viewer.settled();

      const half = VIEWPORT.width / 2;
      const focal_px = VIEWPORT.height / 2 / Math.tan(FIELD_OF_VIEW_RAD / 2);
      const { scale, center } = place(stand.manifest.specimen.bounds_um);
      const [{ center: ball, radius }] = BALLS;
      const [x, y, z] = ball.map((v, i) => (v - center[i]) * scale);
      const depth = XR_DISTANCE_M - z;
      // the middle of a ball's outline lies a little farther out than its centre's image
      const perMetre = (focal_px * depth) / (depth ** 2 - (radius * scale) ** 2);
      const around_px = (1.3 * radius * scale * focal_px) / depth;

      const found = [];
      for (const [left, side] of [
        [0, -1],
        [half, 1],
      ] as const) {
        const eye = await takePicture(stand.viewer.page, {
          x: left,
          y: 0,
          width: half,
          height: VIEWPORT.height,
        });
        const wanted_px = half / 2 + perMetre * (x - (side * PUPILS_M) / 2);
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
