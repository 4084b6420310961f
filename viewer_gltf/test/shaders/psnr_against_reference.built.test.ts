/**
 * Compares the viewer's image with the float64 reference renderer,
 * tests/support/reference_raymarch.py: for the fixture, and for a real stack if
 * STEREOCELL_REAL_BUNDLE names its bundle. Skipped without the repository's .venv (`make setup`).
 */
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { framingDistance, place } from "../../src/render/placement";
import { withoutMarks } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand, type Stand } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { askPython, hasPython } from "../support/python";

const REAL = process.env.STEREOCELL_REAL_BUNDLE;
const FIELD_OF_VIEW_DEG = 40;
const VIEWPORT = { width: 360, height: 240 };
const MIN_DB = 40;
/** Number of frames of a view at rest after which their mean has little noise. */
const GATHERED = 20;

/**
 * Shows only these channels, as volumes everywhere, from the front. Returns how near the image is
 * to the reference, in dB.
 */
async function compare(stand: Stand, channels: readonly string[]) {
  // the reference has no shading
  await stand.open(`&mode=all&quality=auto#v=1&depth=0&c=${channels.join(",")}`);
  await stand.viewer.settled();
  // an image at rest is the mean of many, whose samples interleave
  const frames = () => stand.viewer.page.evaluate(() => window.stereocell?.frames ?? 0);
  const first = await frames();
  await expect.poll(frames, { timeout: 60_000 }).toBeGreaterThan(first + GATHERED);
  const folder = await mkdtemp(join(tmpdir(), "stereocell-psnr-"));
  const picture = join(folder, "picture.png");
  const stage = stand.viewer.page.locator(".stage canvas");
  const box = await stage.boundingBox();
  if (box === null) throw new Error("no canvas");
  await withoutMarks(stand.viewer.page, () => stage.screenshot({ path: picture }));
  const { scale, center, size } = place(stand.manifest.specimen.bounds_um);
  const fov_rad = (FIELD_OF_VIEW_DEG * Math.PI) / 180;
  const away = framingDistance(size, fov_rad, box.width / box.height) / scale;
  const asked = {
    channels,
    eye_um: [center[0], center[1], center[2] + away],
    target_um: center,
    fov_deg: FIELD_OF_VIEW_DEG,
  };
  const printed = await askPython("bundle_picture", [stand.bundle, picture], JSON.stringify(asked));
  await rm(folder, { recursive: true });
  return JSON.parse(printed) as { psnr: number; drawn: number };
}

describe.skipIf(!hasPython)("compared with the float64 reference", () => {
  describeInChromium("the image of the fixture", () => {
    const stand = prepareStand({ viewport: VIEWPORT, pixelRatio: 1 });
    const all = ["F_x20_body", "Balls", "Block"];
    for (const channels of [["Balls"], ["Block"], all]) {
      // in most runs only once, and with real data if available
      it.runIf(IS_EXHAUSTIVE || (REAL === undefined && channels === all))(
        `has a PSNR above 40 dB: ${channels.join(", ")}`,
        async () => {
          const { psnr, drawn } = await compare(stand, channels);
          expect(drawn).toBeGreaterThan(280);
          expect(psnr).toBeGreaterThan(MIN_DB);
        },
      );
    }
  });

  describe.skipIf(REAL === undefined)("with a real stack", () => {
    describeInChromium("the image", () => {
      const stand = prepareStand({ bundle: REAL, viewport: VIEWPORT, pixelRatio: 1 });
      it("has a PSNR above 40 dB", async () => {
        const { psnr, drawn } = await compare(stand, [stand.manifest.channels[0].id]);
        expect(drawn).toBeGreaterThan(280);
        expect(psnr).toBeGreaterThan(MIN_DB);
      });
    });
  });
});
