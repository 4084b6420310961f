/** Moving through the volume distance in stereo: surfaces from afar, volumes near by, and back. */
import { expect, it } from "vitest";
import { NAME_S } from "../../src/annotations/hover_name";
import { difference, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SWITCH_M = 0.75;

describeInChromium("nearer and farther on the split screen", () => {
  const stand = prepareStand({ viewport: { width: 320, height: 160 }, hasRests: true });

  it("goes from surfaces to volumes, and back", async () => {
    const { page } = stand.viewer;
    await stand.open(`&mode=disc&switch=${SWITCH_M}&disc=20&quality=low`);
    await page.keyboard.press("j"); // choosing by gaze off
    await page.keyboard.press("P");
    await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(true);
    const seen = async () => {
      await stand.viewer.settled();
      const { specimenAt, discRadius_deg, volumes, triangles } = await stand.viewer.snapshot();
      return {
        distance_m: Math.hypot(...specimenAt),
        isVolume: discRadius_deg > 0 && volumes.length > 0,
        triangles,
      };
    };
    /**
     * Presses a key until the representation changes. Returns the distance before and after the
     * change.
     */
    const walk = async (key: string, isVolume: boolean) => {
      let before = await seen();
      expect(before.isVolume).toBe(!isVolume);
      for (let i = 0; i < 20; i++) {
        await page.keyboard.press(key);
        await page.waitForTimeout(300); // the disc grows
        const now = await seen();
        expect(now.distance_m < before.distance_m).toBe(key === "+");
        if (now.isVolume === isVolume) return [before.distance_m, now.distance_m] as const;
        before = now;
      }
      throw new Error(`nothing has changed at ${before.distance_m} m`);
    };
    /** Difference of the frame from one with surfaces only. */
    const unlikeSurfaces = async () => {
      await expect.poll(async () => (await stand.viewer.snapshot()).stereoNotices.length).toBe(0);
      const pictures = [];
      for (const mode of ["disc", "off", "disc"]) {
        await page.locator("select[data-mode]").selectOption(mode);
        await page.waitForTimeout(3 * NAME_S * 1000); // all frames show the name under the gaze
        await stand.viewer.settled();
        pictures.push(await takePicture(page, { x: 0, y: 0, width: 320, height: 160 }));
      }
      return difference(pictures[0], pictures[1]);
    };

    expect((await seen()).triangles).toBeGreaterThan(0);
    expect(await unlikeSurfaces()).toBeLessThan(0.001);
    const [far, near] = await walk("+", true);
    expect(near).toBeLessThan(far);
    expect(await unlikeSurfaces()).toBeGreaterThan(0.005);
    const [nearer, farther] = await walk("-", false);
    // no flicker, and no sticking: volumes disappear a tenth farther away than they appeared
    expect(nearer).toBeGreaterThanOrEqual(near * 0.999);
    expect(farther).toBeLessThan(1.35 * far);
    expect(await unlikeSurfaces()).toBeLessThan(0.001);
  });
});
