/**
 * A scene looks the same as surfaces at each level of detail, ray-marched, path-traced, and in
 * slices. STEREOCELL_FORM_BUNDLES lists the bundles of tests/support/form_scenes.py, joined by ":".
 */
import { createHash } from "node:crypto";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { beforeAll, describe, expect, it } from "vitest";
import { ERROR_TARGET_PX } from "../../src/host/form";
import type { Vec3 } from "../../src/math/vec3";
import { framingDistance, place } from "../../src/render/placement";
import { placeIn, sliceFrames } from "../../src/slices/slice_frame";
import { type Picture, type Pixel, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand, type Stand } from "../support/browser/stand";
import { colorDifference, toLab } from "../support/color_difference";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { overlap, type Silhouette, silhouetteOf } from "../support/silhouette";

const BUNDLES = (process.env.STEREOCELL_FORM_BUNDLES ?? "")
  .split(":")
  .filter((path) => path !== "");
/**
 * The scenes that are path-traced: one in most runs, because a software renderer takes a minute for
 * each.
 */
const TRACED = IS_EXHAUSTIVE ? BUNDLES : BUNDLES.slice(0, 1);
/** Least intersection over union of two silhouettes. */
const MIN_OVERLAP = 0.95;
/** The same limit for a level that the page uses only when the object is a few pixels large. */
const MIN_OVERLAP_FROM_AFAR = 0.8;
/** Largest difference of mean colours (CIEDE2000). */
const MAX_DELTA_E = 8;
/**
 * Samples after which a path-traced image is no longer the stand-in, so that the denoiser smooths
 * its noise; and samples after which the noise at its rim is gone, too.
 */
const SAMPLES = [5, 20] as const;
const PATIENT = { timeout: 120_000 };
const FIELD_OF_VIEW_DEG = 40;
/** Thickness, in voxels, of the slab of a volume that is compared with a slice. */
const SLAB_VOXELS = 1;
const VOXELS_ACROSS = 63;
/** Brightness, of 255, of a pixel that the rim of a clip covers by half. */
const RIM = 56;

let pictures = 0;

type TilesetNode = { geometricError: number; children?: TilesetNode[] };

/** The mean colours over the pixels that show the object in both images. */
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

function expectAlike(surface: Picture, picture: Picture, name: string, least = MIN_OVERLAP): void {
  const shared = overlap(silhouetteOf(surface), silhouetteOf(picture));
  const [a, b] = meansOf([surface, picture]).map(toLab);
  expect.soft(shared, `${name}: silhouette`).toBeGreaterThan(least);
  expect.soft(colorDifference(a, b), `${name}: colour`).toBeLessThan(MAX_DELTA_E);
}

/**
 * A link with the transfer function that shows the surface's objects in the volume; a microscope's
 * volumes open translucent.
 */
function asBodies({ manifest }: Stand): string {
  const { id, transfer_function: name } = manifest.channels[0];
  return name === "soft" ? `&l=${id}:tdefault` : "";
}

async function pictureOf(stand: Stand, mode: string, link = asBodies(stand)): Promise<Picture> {
  // an address that differs only in its hash would not reload the page
  const query = `&mode=${mode}&quality=high&picture=${pictures++}`;
  await stand.open(`${query}#v=1&cut=none${link}`);
  await stand.viewer.settled();
  return takePicture(stand.viewer.page);
}

/**
 * The path-traced image, with enough samples for the silhouette of `surface`, or for as long as the
 * test waits.
 */
async function tracedLike(stand: Stand, surface: Picture): Promise<Picture> {
  let picture = await pictureOf(stand, "traced");
  const samples = async () => (await stand.viewer.snapshot()).traced.samples;
  for (const least of SAMPLES) {
    await expect.poll(samples, PATIENT).toBeGreaterThan(least);
    picture = await takePicture(stand.viewer.page);
    if (overlap(silhouetteOf(surface), silhouetteOf(picture)) > MIN_OVERLAP) break;
  }
  return picture;
}

/** The edge of a pixel in the plane through the specimen's middle, um. */
function pixelSize(stand: Stand, { width, height }: Picture): number {
  const { scale, size } = place(stand.manifest.specimen.bounds_um);
  const fov_rad = (FIELD_OF_VIEW_DEG * Math.PI) / 180;
  const away_um = framingDistance(size, fov_rad, width / height) / scale;
  return (2 * Math.tan(fov_rad / 2) * away_um) / height;
}

/** The object as all pixels that are not dark: a clip's rim faces sideways and is dark. */
function thresholded(picture: Picture): Silhouette {
  return Array.from({ length: picture.width * picture.height }, (_, i) => {
    const pixel = picture.at(i % picture.width, Math.floor(i / picture.width));
    return Math.max(...pixel) > RIM;
  });
}

/** Serves a tileset without the finest `coarser` levels. */
async function keepCoarser(stand: Stand, path: string, coarser: number): Promise<void> {
  const tileset = JSON.parse(await readFile(join(stand.bundle, path), "utf8"));
  const chain: TilesetNode[] = [];
  for (let at: TilesetNode | undefined = tileset.root.children[0]; at; at = at.children?.[0]) {
    chain.push(at);
  }
  delete chain[chain.length - 1 - coarser].children;
  const body = JSON.stringify(tileset);
  const sha256 = createHash("sha256").update(body).digest("hex");
  const [channel, ...others] = stand.manifest.channels;
  const channels = [{ ...channel, tileset: { path, bytes: body.length, sha256 } }, ...others];
  const manifest = JSON.stringify({ ...stand.manifest, channels });
  stand.host.overrides.set(`/bundle/${path}`, { status: 200, body });
  stand.host.overrides.set("/bundle/manifest.json", { status: 200, body: manifest });
}

describeInChromium("one scene in all representations", () => {
  if (BUNDLES.length === 0) it.skip("needs STEREOCELL_FORM_BUNDLES");

  describe.each(BUNDLES)("of %s", (bundle) => {
    const stand = prepareStand({ bundle, viewport: { width: 640, height: 300 }, pixelRatio: 0.8 });

    /**
     * Image of the surface at its finest level, with which the other representations are compared.
     */
    let surface: Picture;
    beforeAll(async () => {
      surface = await pictureOf(stand, "off");
    });

    it("has the same silhouette and colour as surface and as volume", async () => {
      expectAlike(surface, await pictureOf(stand, "all"), "marched");
    });

    it.runIf(TRACED.includes(bundle))(
      "has the same silhouette and colour when path-traced",
      async () => {
        expectAlike(surface, await tracedLike(stand, surface), "traced");
      },
    );

    it("has the same silhouette and colour at each level of detail for this distance", async () => {
      const { tileset, distances } = stand.manifest.channels[0];
      if (tileset === null || distances === undefined) throw new Error("the scene has no surface");
      const pixel_um = pixelSize(stand, surface);
      for (let level = 1; level < distances.length; level++) {
        await keepCoarser(stand, tileset.path, level);
        const isShownHere = distances[level].largest_um <= ERROR_TARGET_PX * pixel_um;
        const least = isShownHere ? MIN_OVERLAP : MIN_OVERLAP_FROM_AFAR;
        expectAlike(surface, await pictureOf(stand, "off"), `level ${level}`, least);
      }
    });

    it("has the same silhouette in a slice as in a slab of its volume", async () => {
      const { bounds_um, sides } = stand.manifest.specimen;
      const { center } = place(bounds_um);
      const voxel_um = (bounds_um.max[0] - bounds_um.min[0]) / VOXELS_ACROSS;
      const half = (SLAB_VOXELS / 2) * voxel_um;
      const [min, max] = [bounds_um.min, bounds_um.max].map((corner) => [...corner]);
      [min[2], max[2]] = [center[2] - half, center[2] + half];
      const { id } = stand.manifest.channels[0];
      const link = `&box=${[...min, ...max].join(",")}&l=${id}:tsharp`;
      const slab = await pictureOf(stand, "all", link);
      const found = thresholded(slab);

      const frames = sliceFrames({ point: center, turn_deg: [0, 0, 0] }, bounds_um, sides ?? null);
      const index = frames.findIndex(({ normal }) => Math.abs(normal[2]) > 0.99);
      await stand.open("&mode=off&quality=high#v=1&cut=none&slices=on");
      await stand.viewer.settled();
      const { width, height, values } = await stand.viewer.page.evaluate((at) => {
        const canvas = document.querySelector<HTMLCanvasElement>(`[data-slice="${at}"] canvas`);
        const context = canvas?.getContext("2d");
        if (canvas == null || context == null) throw new Error("there is no image of the slice");
        const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
        const values = Array.from(data).filter((_, i) => i % 4 === 0);
        return { width: canvas.width, height: canvas.height, values };
      }, index);
      const level = 255 * (stand.manifest.channels[0].iso_normalized ?? 0);
      const perPixel = pixelSize(stand, slab);
      const sliced: Silhouette = found.map((_, i) => {
        const right = ((i % slab.width) + 0.5 - slab.width / 2) * perPixel;
        const down = (Math.floor(i / slab.width) + 0.5 - slab.height / 2) * perPixel;
        const point: Vec3 = [center[0] + right, center[1] - down, center[2]];
        const { x, y } = placeIn(frames[index], point);
        const [column, row] = [Math.floor(x * width), Math.floor(y * height)];
        const isInside = column >= 0 && column < width && row >= 0 && row < height;
        return isInside && values[row * width + column] >= level;
      });
      // the clip's handles, which are blue, lie over the image
      const isSeen = (i: number) => {
        const [r, , b] = slab.at(i % slab.width, Math.floor(i / slab.width));
        return b <= r + 4;
      };
      const seen = found.flatMap((_, i) => (isSeen(i) ? [i] : []));
      const shared = overlap(
        seen.map((i) => found[i]),
        seen.map((i) => sliced[i]),
      );
      expect(shared, "slice: silhouette").toBeGreaterThan(MIN_OVERLAP);
    });
  });
});
