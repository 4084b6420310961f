/**
 * The pipeline's own letter F, from voxels to the picture. STEREOCELL_F_BUNDLES holds the bundles
 * built from what tests/phantoms.py writes, joined by ":"; without it these tests are skipped.
 */
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { expect, it } from "vitest";
import type { Manifest } from "../src/bundle/generated/bundle";
import { launch } from "./driver/chromium";
import { Host } from "./driver/host";
import { ViewerPage } from "./driver/page";
import { describeInChromium } from "./driver/skip";
import { PHANTOM_LETTER } from "./fixture/letter";
import { expectLetter } from "./letter";

const DIST = new URL("../dist/", import.meta.url).pathname;
const BUNDLES = (process.env.STEREOCELL_F_BUNDLES ?? "").split(":").filter((path) => path !== "");

describeInChromium("the pipeline's F", () => {
  if (BUNDLES.length === 0) it.skip("needs STEREOCELL_F_BUNDLES");

  for (const bundle of BUNDLES) {
    for (const as of ["surface", "volume"] as const) {
      it(`of ${bundle} as a ${as} is neither mirrored nor turned`, async () => {
        const text = await readFile(join(bundle, "manifest.json"), "utf8");
        const manifest: Manifest = JSON.parse(text);
        expect(manifest.channels.map(({ name }) => name)).toEqual(["F"]);
        const host = await Host.start({ "/": DIST, "/bundle/": bundle });
        const browser = await launch({ width: 504, height: 240 });
        try {
          const viewer = new ViewerPage(await browser.context.newPage());
          await viewer.open(`${host.address}/?bundle=bundle/`);
          await expectLetter(viewer, manifest, manifest.channels[0].id, as, PHANTOM_LETTER);
        } finally {
          await browser.close();
          await host.stop();
        }
      });
    }
  }
});
