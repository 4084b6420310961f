/** A bundle's tilesets are 3D Tiles for everyone: CesiumJS opens, decodes and draws them. */
import { describe, expect, it } from "vitest";
import type { Manifest } from "../../src/bundle/generated/bundle";
import { hasColor, isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, MAPS_BUNDLE, prepareStand } from "../support/browser/stand";
import { FIXTURE_LETTER } from "../support/fixture/letter";
import { CESIUM, Globe, type View } from "../support/interop/globe";

const VIEWPORT = { width: 320, height: 180 };
/** Pixels of error as Cesium counts them: the tiles' coarsest surfaces, and the finest. */
const [COARSEST, FINEST] = [100, 0];

function viewOf({ bounds_um: { min, max } }: Manifest["specimen"]): View {
  const width_um = 1.3 * Math.max(max[0] - min[0], (16 / 9) * (max[1] - min[1]));
  return {
    center: [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2],
    width_um,
  };
}

describeInChromium("CesiumJS", () => {
  const options = { viewport: VIEWPORT, mounts: () => ({ "/cesium/": CESIUM }) };

  describe("with the synthetic bundle", () => {
    const stand = prepareStand(options);

    it("draws the F neither mirrored nor turned, where it belongs", async () => {
      const globe = await Globe.open(stand.viewer.page, stand.host);
      const address = "/bundle/channels/F_x20_body/tileset.json";
      const { failed } = await globe.draw(address, viewOf(stand.manifest.specimen), FINEST);
      expect([...failed, ...globe.errors]).toEqual([]);
      const picture = await takePicture(stand.viewer.page);
      const { inside, outside } = FIXTURE_LETTER.front;
      for (const point of [...inside, ...outside]) {
        const { x, y } = await globe.pixelOf(point);
        expect(isBackground(picture.at(x, y)), `${point}`).toBe(outside.includes(point));
      }
    });
  });

  describe("with a bundle of the pipeline", () => {
    const stand = prepareStand({ ...options, bundle: DEMO_BUNDLE });

    it("decodes every channel and draws it in its colour and place", async () => {
      const { specimen, channels } = stand.manifest;
      const { min, max } = specimen.bounds_um;
      const globe = await Globe.open(stand.viewer.page, stand.host);
      const finest = (triangles: readonly number[]) => triangles[0] ?? Number.POSITIVE_INFINITY;
      const least = Math.min(...channels.map(({ triangles }) => finest(triangles)));
      for (const { id, color, tileset, triangles } of channels) {
        if (tileset === null) continue;
        // Software draws them: the coarsest of all, and the finest of the smallest.
        const errors_px = finest(triangles) === least ? [COARSEST, FINEST] : [COARSEST];
        for (const error_px of errors_px) {
          const address = `/bundle/${tileset.path}`;
          const { loaded, failed } = await globe.draw(address, viewOf(specimen), error_px);
          expect([...failed, ...globe.errors]).toEqual([]);
          expect(loaded).toBeGreaterThan(0);
          const picture = await takePicture(stand.viewer.page);
          const drawn = picture.where((pixel) => !isBackground(pixel));
          expect(drawn.length, id).toBeGreaterThan(500);
          expect(picture.count(hasColor(color)) / drawn.length, id).toBeGreaterThan(0.9);
          // The front of the specimen's box covers all of it.
          const low = await globe.pixelOf([min[0], min[1], max[2]]);
          const high = await globe.pixelOf([max[0], max[1], max[2]]);
          const isOutside = ([x, y]: [number, number]) =>
            x < low.x - 2 || x > high.x + 2 || y > low.y + 2 || y < high.y - 2;
          expect(drawn.filter(isOutside), id).toEqual([]);
        }
      }
      const asked = stand.host.requests.map(({ path }) => path);
      expect(asked.filter((path) => path.endsWith("/lod0.glb"))).not.toEqual([]);
    });
  });

  describe.skipIf(!MAPS_BUNDLE)("with a bundle whose surfaces have baked maps", () => {
    const stand = prepareStand({ ...options, bundle: MAPS_BUNDLE });

    it("transcodes their images from KTX2", async () => {
      const { specimen, channels } = stand.manifest;
      const globe = await Globe.open(stand.viewer.page, stand.host);
      const address = `/bundle/${channels.find(({ tileset }) => tileset !== null)?.tileset?.path}`;
      for (const error_px of [COARSEST, FINEST]) {
        const { failed } = await globe.draw(address, viewOf(specimen), error_px);
        expect([...failed, ...globe.errors]).toEqual([]);
      }
      const asked = stand.host.requests.map(({ path }) => path);
      const transcoder = asked.filter((path) => path.endsWith("/basis_transcoder.wasm"));
      expect(transcoder).toHaveLength(1);
    });
  });
});
