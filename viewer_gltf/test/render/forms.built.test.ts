/**
 * A scene looks like one thing as surfaces, marched, and path-traced.
 * STEREOCELL_FORM_BUNDLES holds the bundles of tests/support/form_scenes.py, joined by ":".
 */
import { describe, expect, it } from "vitest";
import { type Picture, type Pixel, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { colorDifference, toLab } from "../support/color_difference";

const BUNDLES = (process.env.STEREOCELL_FORM_BUNDLES ?? "")
  .split(":")
  .filter((path) => path !== "");
/**
 * Least intersection over union of two silhouettes. Of fluorescence the volume begins half-way between
 * background and surface, so that faint structure shows, and reaches a voxel beyond the surface.
 */
const MIN_OVERLAP = (bundle: string) => (bundle.includes("fluorescence") ? 0.85 : 0.94);
/** Largest difference of mean colours (CIEDE2000). */
const MAX_DELTA_E = 8;
/** Samples of a traced picture from which on it is its own, and the denoiser smooths the rest. */
const SAMPLES = 5;
const PATIENT = { timeout: 120_000 };

/** The largest part of the colour of the room's background, of 255, and a little. */
const DARK = 24;

type Silhouette = readonly boolean[];

/** Pixels of which the object covers at least half, by the light of those that it covers whole. */
function silhouetteOf(picture: Picture): Silhouette {
  const light: number[] = [];
  for (let y = 0; y < picture.height; y++) {
    for (let x = 0; x < picture.width; x++) light.push(Math.max(...picture.at(x, y)));
  }
  const shown = light.filter((v) => v > DARK).sort((a, b) => a - b);
  const half = (DARK + shown[Math.floor(shown.length / 2)]) / 2;
  return light.map((v) => v > half);
}

function overlap(a: Silhouette, b: Silhouette): number {
  const both = a.filter((inside, i) => inside && b[i]).length;
  const either = a.filter((inside, i) => inside || b[i]).length;
  return both / either;
}

/** Over the pixels that show the object in both pictures. */
function meansOf(pictures: readonly Picture[]): readonly Pixel[] {
  const silhouettes = pictures.map(silhouetteOf);
  const { width } = pictures[0];
  const shared = silhouettes[0].flatMap((inside, i) => (inside && silhouettes[1][i] ? [i] : []));
  return pictures.map((picture) => {
    const sums = [0, 0, 0];
    for (const i of shared) {
      for (const [k, v] of picture.at(i % width, Math.floor(i / width)).entries()) sums[k] += v;
    }
    return [sums[0] / shared.length, sums[1] / shared.length, sums[2] / shared.length] as const;
  });
}

describeInChromium("one scene in three forms", () => {
  if (BUNDLES.length === 0) it.skip("needs STEREOCELL_FORM_BUNDLES");

  describe.each(BUNDLES)("of %s", (bundle) => {
    const stand = prepareStand({ bundle, viewport: { width: 640, height: 300 }, pixelRatio: 0.8 });

    const pictureOf = async (mode: string): Promise<Picture> => {
      await stand.open(`&mode=${mode}&quality=high#v=1&cut=none`);
      await stand.viewer.settled();
      const samples = async () => (await stand.viewer.snapshot()).traced.samples;
      if (mode === "traced") await expect.poll(samples, PATIENT).toBeGreaterThan(SAMPLES);
      return takePicture(stand.viewer.page);
    };

    it("has one silhouette and one colour", async () => {
      const surface = await pictureOf("off");
      const forms = { marched: await pictureOf("all"), traced: await pictureOf("traced") };
      for (const [name, picture] of Object.entries(forms)) {
        const shared = overlap(silhouetteOf(surface), silhouetteOf(picture));
        expect(shared, `${name}: silhouette`).toBeGreaterThan(MIN_OVERLAP(bundle));
        const [a, b] = meansOf([surface, picture]).map(toLab);
        expect(colorDifference(a, b), `${name}: colour`).toBeLessThan(MAX_DELTA_E);
      }
    });
  });
});
