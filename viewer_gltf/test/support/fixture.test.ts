/** Checks pixels of bodies whose appearance is known. */
import { beforeEach, expect, it } from "vitest";
import { project } from "./browser/camera";
import { lightOf } from "./browser/light";
import { isBackground, type Picture, type Pixel, takePicture } from "./browser/picture";
import { describeInChromium } from "./browser/skip";
import { prepareStand } from "./browser/stand";
import { BALLS, BLOCK } from "./fixture/bodies";
import { BLOCK_OPACITY } from "./fixture/bundle";
import { FIXTURE_LETTER } from "./fixture/letter";
import { SPACING } from "./fixture/volumes";
import { expectLetter } from "./letter";

const F = "F_x20_body";

describeInChromium("the view of the fixture", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 272 }, pixelRatio: 1 });

  beforeEach(async () => {
    await stand.open("#v=1&depth=0"); // depth shading is measured in other tests
    await stand.viewer.showOnly();
  });

  function spotOf({ width, height }: Picture, point: readonly [number, number, number]) {
    return project(point, stand.manifest.specimen.bounds_um, width, height);
  }

  function at(picture: Picture, point: readonly [number, number, number]): Pixel {
    const { x, y } = spotOf(picture, point);
    return picture.at(x, y);
  }

  const showAsVolume = (id: string) => stand.viewer.showAs(id, "volume");

  for (const as of ["surface", "volume"] as const) {
    it(`shows the F as a ${as} neither mirrored nor rotated`, () =>
      expectLetter(stand.viewer, stand.manifest, F, as, FIXTURE_LETTER));
  }

  it("draws a uniform block with the opacity of its length", async () => {
    // measured by the blue light of a ball behind the block, because no light on the block is blue
    const { center, radius } = BALLS[3];
    await stand.viewer.showAs("Balls", "surface");
    await stand.viewer.recolor("Balls", "#0000ff");
    const alone = await takePicture(stand.viewer.page);
    await showAsVolume("Block");
    await stand.viewer.recolor("Block", "#ff0000");
    const veiled = await takePicture(stand.viewer.page);
    const { cosine } = spotOf(veiled, center);
    // length to the place where the ray towards the ball's middle hits the ball
    const length = (BLOCK.max[2] - center[2]) / cosine - radius;
    const voxels = length / Math.min(...SPACING);
    const expected = 1 - (1 - BLOCK_OPACITY / 255) ** voxels;
    const [before, after] = [alone, veiled].map((picture) => lightOf(at(picture, center)[2]));
    expect(before).toBeGreaterThan(0.1);
    expect(1 - after / before).toBeCloseTo(expected, 1.5);
  });

  it("lets surfaces hide volumes behind them, and volumes partly hide surfaces", async () => {
    await stand.viewer.showAs("Balls", "surface");
    const inFront = at(await takePicture(stand.viewer.page), BALLS[2].center);
    const behind = at(await takePicture(stand.viewer.page), BALLS[3].center);
    await showAsVolume("Block");
    const veiled = await takePicture(stand.viewer.page);
    expect(at(veiled, BALLS[2].center)).toEqual(inFront);
    const [, green, blue] = at(veiled, BALLS[3].center);
    // the green of the block over the blue of the ball
    expect(green).toBeGreaterThan(behind[1] + 20);
    expect(blue).toBeLessThan(behind[2] - 20);
  });

  it("keeps the order if a surface is slightly translucent", async () => {
    await stand.viewer.showAs("Balls", "surface");
    await showAsVolume("Block");
    const opaque = await takePicture(stand.viewer.page);
    await stand.viewer.openCard("Balls");
    await stand.viewer.slide("Balls/opacity", 0.96);
    const glass = await takePicture(stand.viewer.page);
    for (const { center } of [BALLS[2], BALLS[3]]) {
      const [before, after] = [at(opaque, center), at(glass, center)];
      expect(after).not.toEqual(before);
      after.forEach((v, i) => {
        expect(Math.abs(v - before[i])).toBeLessThan(8);
      });
    }
    await stand.viewer.slide("Balls/opacity", 0.5);
    const half = at(await takePicture(stand.viewer.page), BALLS[2].center);
    await stand.viewer.show("Balls", false);
    const behind = at(await takePicture(stand.viewer.page), BALLS[2].center);
    half.forEach((v, i) => {
      const both = [at(opaque, BALLS[2].center)[i], behind[i]].map(lightOf);
      expect(Math.abs(lightOf(v) - (both[0] + both[1]) / 2)).toBeLessThan(0.02);
    });
  });

  it("shows less through a softer transfer function", async () => {
    await showAsVolume("Block");
    const point = [56, -42, 12] as const;
    const normal = at(await takePicture(stand.viewer.page), point);
    await stand.viewer.chooseTransferFunction("Block", "soft");
    const soft = at(await takePicture(stand.viewer.page), point);
    expect(soft[1]).toBeLessThan(normal[1] - 20);
    expect(isBackground(soft)).toBe(false);
  });
});
