/** The orientation check: the letter F seen from the front and from its left side. */
import { expect } from "vitest";
import type { Manifest } from "../../src/bundle/generated/bundle";
import { project } from "./browser/camera";
import type { ViewerPage } from "./browser/page";
import { isBackground, takePicture } from "./browser/picture";
import type { LetterPoints } from "./fixture/letter";

/** Shows only this channel, and looks at it from two sides. */
export async function expectLetter(
  viewer: ViewerPage,
  manifest: Manifest,
  channel: string,
  as: "surface" | "volume",
  points: LetterPoints,
): Promise<void> {
  await viewer.showAs(channel, as);
  for (const side of ["front", "left"] as const) {
    if (side === "left") await viewer.turnLeftSideToFront();
    const picture = await takePicture(viewer.page);
    const { bounds_um } = manifest.specimen;
    for (const isInside of [true, false]) {
      for (const point of points[side][isInside ? "inside" : "outside"]) {
        const { x, y } = project(point, bounds_um, picture.width, picture.height, side);
        const where = `${isInside ? "F" : "no F"} at ${point}, from the ${side}`;
        expect(isBackground(picture.at(x, y)), where).toBe(!isInside);
      }
    }
  }
}
