/** A bundle's tilesets are standard 3D Tiles: CesiumJS opens, decodes and draws them. */
import { describe, expect, it } from "vitest";
import type { Manifest } from "../../src/bundle/generated/bundle";
import { hasColor, isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, MAPS_BUNDLE, prepareStand } from "../support/browser/stand";
import { FIXTURE_LETTER } from "../support/fixture/letter";
import { CESIUM, Globe, type View } from "../support/interop/globe";
import { BEAM, CHANNEL, centerOf, labelOf, prepareObjects, rowAt } from "../support/object_bundle";
import { hasPython } from "../support/python";

const VIEWPORT = { width: 320, height: 180 };
/** Largest screen-space errors for Cesium, pixels; it then draws the coarsest and the finest surfaces. */
const [COARSEST, FINEST] = [100, 0];

function viewOf({ bounds_um: { min, max } }: Manifest["specimen"]): View {
  const width_um = 1.3 * Math.max(max[0] - min[0], (16 / 9) * (max[1] - min[1]));
  return {
    center: [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2],
    width_um,
  };
}

describeInChromium("CesiumJS", () => {
  const options = { viewport: VIEWPORT, pixelRatio: 1, mounts: () => ({ "/cesium/": CESIUM }) };

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

  describe.skipIf(!hasPython)("with the objects of a label map", () => {
    const stand = prepareStand({ ...options, bundle: prepareObjects() });

    it("styles objects by their table, and returns the row of a picked one", async () => {
      const globe = await Globe.open(stand.viewer.page, stand.host);
      const address = `/bundle/channels/${CHANNEL}/tileset.json`;
      const { failed } = await globe.draw(address, viewOf(stand.manifest.specimen), FINEST);
      expect([...failed, ...globe.errors]).toEqual([]);
      const isRed = hasColor([1, 0, 0]);
      const isRedAt = async (point: readonly [number, number, number]) => {
        const { x, y } = await globe.pixelOf(point);
        return isRed((await takePicture(stand.viewer.page)).at(x, y));
      };
      const ball = centerOf(rowAt(0, 3, 1, 1));
      await globe.style("volume_um3", "> 300", "red"); // the beam has 400 um3, and a ball has 268 um3
      expect(await isRedAt([60, -42.5, 16])).toBe(true);
      expect(await isRedAt(ball)).toBe(false);
      await globe.style("cell_type", "=== 'Tumour'", "red");
      expect(await isRedAt(ball)).toBe(true);
      expect(await isRedAt([60, -42.5, 16])).toBe(false);
      for (const [point, row] of [
        [ball, rowAt(0, 3, 1, 1)],
        [centerOf(rowAt(1, 4, 0, 1)), rowAt(1, 4, 0, 1)],
        [[57, -42.5, 16], BEAM], // an object in both tiles has the same number in both
        [[63, -42.5, 16], BEAM],
      ] as const) {
        const { x, y } = await globe.pixelOf(point);
        const picked = await globe.pick(x, y);
        expect(picked?.label).toBe(labelOf(row));
        expect(picked?.CD8).toBeCloseTo(10 * 1.15 ** row, -1);
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
        // Drawing in software is slow: all channels are drawn with the coarsest surfaces, and only the smallest with the
        // finest.
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
          // The front face of the specimen's box covers the whole specimen.
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
