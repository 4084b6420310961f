/** Surface and volume of one channel have the same mean colours over the same pixels. */
import { describe, expect, it } from "vitest";
import { isBackground, type Picture, type Pixel, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, HEAD_BUNDLE, MAPS_BUNDLE, prepareStand } from "../support/browser/stand";
import { colorDifference, toLab } from "../support/color_difference";
import { sweep } from "../support/exhaustive";

const VIEWPORT = { width: 640, height: 360 };
const TAN_HALF_FIELD = Math.tan((20 * Math.PI) / 180);
/** Degrees: radius of the disc, and radius within its soft rim where only the volume shows. */
const [DISC, WITHIN] = [12, 6.5];
/** Largest difference of a channel's mean colours (CIEDE2000). */
const MAX_DELTA_E = 5;

/** Mean colours of two images over the pixels inside the disc that show the specimen in both. */
function meansWithin(a: Picture, b: Picture): Readonly<{ pixels: number; means: Pixel[] }> {
  const radius = ((a.height / 2) * Math.tan((WITHIN * Math.PI) / 180)) / TAN_HALF_FIELD;
  const sums = [0, 1].map(() => [0, 0, 0]);
  let pixels = 0;
  for (let y = 0; y < a.height; y++) {
    for (let x = 0; x < a.width; x++) {
      if (Math.hypot(x + 0.5 - a.width / 2, y + 0.5 - a.height / 2) > radius) continue;
      const both = [a.at(x, y), b.at(x, y)];
      if (both.some(isBackground)) continue;
      pixels++;
      both.forEach((pixel, i) => {
        for (const [k, v] of pixel.entries()) sums[i][k] += v;
      });
    }
  }
  return { pixels, means: sums.map(([r, g, b]) => [r / pixels, g / pixels, b / pixels] as const) };
}

/**
 * `solid`: transfer function with which the volume looks like the surface; null: the default one.
 */
type Case = Readonly<{
  name: string;
  bundle: string | undefined;
  channels: readonly string[];
  solid: string | null;
}>;
const CASES: readonly Case[] = [
  { name: "the demo", bundle: DEMO_BUNDLE, channels: ["CD31", "Hoechst"], solid: "default" },
  { name: "real cells", bundle: MAPS_BUNDLE, channels: ["Cells"], solid: "default" },
  { name: "an MR head", bundle: HEAD_BUNDLE, channels: ["MR"], solid: null },
];

for (const { name, bundle, channels, solid } of sweep(CASES, ({ name }) => name !== "real cells")) {
  describe.skipIf(!bundle)(name, () => {
    describeInChromium("inside the disc", () => {
      const stand = prepareStand({ bundle, viewport: VIEWPORT, pixelRatio: 1 });

      for (const channel of sweep(channels, (each) => each === channels[0])) {
        it(`the volume of ${channel} has the colour of its surface`, async () => {
          const at = async (mode: string) => {
            const look = solid === null ? "" : `&l=${channel}:t${solid}`;
            const link = `v=1&cut=none&c=${channel}${look}`;
            await stand.open(`&mode=${mode}&switch=9&disc=${DISC}&quality=high#${link}`);
            await stand.viewer.settled();
            return takePicture(stand.viewer.page);
          };
          const { pixels, means } = meansWithin(await at("disc"), await at("off"));
          expect(pixels).toBeGreaterThan(300);
          const [volume, surface] = means.map(toLab);
          expect(colorDifference(volume, surface)).toBeLessThanOrEqual(MAX_DELTA_E);
        });
      }
    });
  });
}
