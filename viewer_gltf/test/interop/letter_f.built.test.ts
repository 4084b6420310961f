/**
 * The pipeline's letter F, from voxels to the picture. STEREOCELL_F_BUNDLES contains the bundles of the phantoms from
 * tests/support/phantoms.py, joined by ":". Without it these tests are skipped.
 */
import { describe, expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";
import { PHANTOM_LETTER } from "../support/fixture/letter";
import { expectLetter } from "../support/letter";

const BUNDLES = (process.env.STEREOCELL_F_BUNDLES ?? "").split(":").filter((path) => path !== "");

describeInChromium("the pipeline's F", () => {
  if (BUNDLES.length === 0) it.skip("needs STEREOCELL_F_BUNDLES");

  describe.each(BUNDLES)("of %s", (bundle) => {
    const stand = prepareStand({ bundle, viewport: { width: 504, height: 240 } });

    // Each run tests each format once, either as a surface or as a volume.
    const kept = BUNDLES.indexOf(bundle) % 2 === 0 ? "surface" : "volume";
    it.each(sweep(["surface", "volume"] as const, (as) => as === kept))(
      "as a %s is neither mirrored nor turned",
      async (as) => {
        const { channels } = stand.manifest;
        expect(channels).toHaveLength(1); // DICOM and NIfTI do not name the channel
        await stand.open();
        await expectLetter(stand.viewer, stand.manifest, channels[0].id, as, PHANTOM_LETTER);
      },
    );
  });
});
