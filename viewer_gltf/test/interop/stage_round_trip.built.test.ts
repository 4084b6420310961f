/**
 * The viewer shows the changes that an artist made in a layer over the stage. tests/support/stage_edits.py makes the
 * volume and the layer. STEREOCELL_EDIT_BUNDLES contains the bundle of the built stage and that of the layer, joined by
 * ":". Without it these tests are skipped.
 */
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import type { Manifest } from "../../src/bundle/generated/bundle";
import { toHex } from "../../src/math/color";
import { project } from "../support/browser/camera";
import { lightAt, lightFacing, SCATTERED } from "../support/browser/light";
import { hasColor, isBackground, type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand, type Stand } from "../support/browser/stand";

const [BUILT, EDITED] = (process.env.STEREOCELL_EDIT_BUNDLES ?? "").split(":");

// The same values as in tests/support/stage_edits.py.
const SPACING_UM = 0.5;
const RADIUS_UM = 4;
const SLAB_VOXELS = 16;
const COLOR = [0.888, 0.2623, 0.0213] as const;
const [HIDDEN, MOVED] = ["r0_c1", "r1_c1"];
const [AS_BOTH, AS_VOLUME, COARSE] = ["r0_c0", "r0_c2", "r1_c2"];
const COARSE_LOD = 3;
/** The tile in which only the colours are edited. */
const PLAIN = "r1_c0";
const MOVE_UM = [2, 7, 0] as const;
const SLAB_OPACITY = 0.03;
const FUNCTION = "sharp";

/** The level of the other tiles; its error is below a pixel. */
const DUE_LOD = 1;
const VIEWPORT = { width: 960, height: 544 };

type Vec3 = readonly [number, number, number];
type Spot = Readonly<{ x: number; y: number }>;

/** Returns the centre of a tile's ball. Tiles have 32 x 32 x 24 voxels, and the first voxel's centre is the origin. */
function centerOf(tile: string): Vec3 {
  const [, row, column] = /^r(\d)_c(\d)$/.exec(tile) ?? [];
  return [
    SPACING_UM * (32 * Number(column) + 15.5),
    -SPACING_UM * (32 * Number(row) + 15.5),
    SPACING_UM * 11.5,
  ];
}

const plus = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

/** Turns depth shading off: volumes beside surfaces have none, but a specimen that is all volumes does. */
const UNSHADED = "#v=1&depth=0";

/** Shows only one channel, with a single change, so that no intermediate state is drawn. */
async function only(stand: Stand, id: string, as: "surface" | "volume"): Promise<Picture> {
  await stand.viewer.page.evaluate(
    ([wanted, isVolume]) => {
      const set = (name: string, channel: string, isOn: boolean) => {
        const box = document.querySelector<HTMLInputElement>(
          `[data-channel="${channel}"] [data-part="${name}"]`,
        );
        if (box === null) throw new Error(`no ${name} of ${channel}`);
        if (box.checked !== isOn) box.click();
      };
      for (const { id } of window.stereocell?.snapshot().state.channels ?? []) {
        set("shown", id, id === wanted);
      }
      const card = document.querySelector<HTMLElement>(`[data-channel="${wanted}"] [data-opener]`);
      if (card?.ariaExpanded === "false") card.click();
      set("volume", wanted, isVolume);
      const modes = document.querySelector<HTMLSelectElement>("select[data-mode]");
      if (!isVolume || modes === null) return;
      modes.value = "all";
      modes.dispatchEvent(new Event("change"));
    },
    [id, as === "volume"] as const,
  );
  await stand.viewer.settled();
  return takePicture(stand.viewer.page);
}

const isDrawn = (picture: Picture, x: number, y: number) => !isBackground(picture.at(x, y));

function spot(picture: Picture, { specimen }: Manifest, point: Vec3): Spot & { radius: number } {
  const at = (p: Vec3) => project(p, specimen.bounds_um, picture.width, picture.height);
  const { x, y } = at(point);
  return { x, y, radius: at(plus(point, [RADIUS_UM, 0, 0])).x - x };
}

/** Returns centre and area of the drawn pixels within 1.4 radii of a spot. */
function blob(picture: Picture, { x, y, radius }: Spot & { radius: number }) {
  const near = picture
    .where((pixel) => !isBackground(pixel))
    .filter(([px, py]) => Math.hypot(px - x, py - y) < 1.4 * radius);
  const mean = (i: 0 | 1) => near.reduce((sum, p) => sum + p[i], 0) / near.length;
  return { x: mean(0), y: mean(1), area: near.length };
}

/** Returns the number of triangles in one level of a tile's ball. */
async function trianglesOf(bundle: string, tile: string, level: number): Promise<number> {
  const glb = await readFile(join(bundle, "channels", "Balls", tile, `lod${level}.glb`));
  const document = JSON.parse(glb.toString("utf8", 20, 20 + glb.readUInt32LE(12)));
  return document.accessors[document.meshes[0].primitives[0].indices].count / 3;
}

/** Returns the largest difference of a pixel's components, of 255. */
function apart(a: Picture, b: Picture, x: number, y: number): number {
  const other = b.at(x, y);
  return Math.max(...a.at(x, y).map((v, i) => Math.abs(v - other[i])));
}

describeInChromium("an artist's layer over the stage", () => {
  if (BUILT === "" || EDITED === undefined) {
    it.skip("needs STEREOCELL_EDIT_BUNDLES");
    return;
  }
  const pictures = new Map<string, Picture>();
  const remembered = (name: string) => {
    const picture = pictures.get(name);
    if (picture === undefined) throw new Error(`no picture of ${name}`);
    return picture;
  };

  // Both bundles have the same view, because the edits do not change the specimen's box.
  describe("the stage as built", () => {
    const stand = prepareStand({ bundle: BUILT, viewport: VIEWPORT });

    it("shows a ball in each tile, and opaque blocks", async () => {
      await stand.open(UNSHADED);
      const balls = await only(stand, "Balls", "surface");
      for (const { id } of stand.manifest.tiles) {
        const { x, y } = spot(balls, stand.manifest, centerOf(id));
        expect(isDrawn(balls, x, y), id).toBe(true);
      }
      expect(balls.count(hasColor(COLOR))).toBe(0);
      // The expected picture has the layer's settings, chosen in the panel.
      await stand.viewer.recolor("Balls", toHex(COLOR));
      for (const as of ["surface", "volume"] as const) {
        pictures.set(`balls as a ${as}`, await only(stand, "Balls", as));
      }

      await only(stand, "Slab", "volume");
      await stand.viewer.chooseTransferFunction("Slab", "default");
      await stand.viewer.recolor("Slab", "#ffffff");
      const slab = await takePicture(stand.viewer.page);
      // An opaque block returns all light that falls on it; otherwise the dark background would show through.
      const place = spot(slab, stand.manifest, centerOf("r1_c0"));
      expect(lightAt(slab, place)).toBeGreaterThan(0.95 * lightFacing(slab, place));

      const sheet = await only(stand, "Sheet", "volume");
      pictures.set("sheet", sheet);
      await stand.viewer.chooseTransferFunction("Sheet", FUNCTION);
      pictures.set("chosen sheet", await takePicture(stand.viewer.page));
    });
  });

  describe("the layer", () => {
    const stand = prepareStand({ bundle: EDITED, viewport: VIEWPORT, sharesPage: true });
    let isOpen = false;
    /** Opens the page unless an earlier test has done so; each test sets everything that it looks at. */
    async function openOnce(): Promise<void> {
      if (!isOpen) await stand.open(UNSHADED);
      isOpen = true;
    }

    /** Returns whether the edits may change the silhouettes at a pixel, including that of the coarse surface. */
    function isTouched(picture: Picture, x: number, y: number): boolean {
      const places: [Vec3, number][] = [HIDDEN, MOVED].map((tile) => [centerOf(tile), 1.4]);
      places.push([plus(centerOf(MOVED), MOVE_UM), 1.4]);
      // A coarse surface with the volume of the ball has corners outside the ball.
      places.push([centerOf(COARSE), 1.6]);
      return places.some(([place, radii]) => {
        const at = spot(picture, stand.manifest, place);
        return Math.hypot(x - at.x, y - at.y) < radii * at.radius;
      });
    }

    async function chooseQuality(level: "low" | "high"): Promise<void> {
      await stand.viewer.unfold("quality");
      const choice = stand.viewer.page.locator(`[data-quality="${level}"]`);
      await choice.check({ force: true });
      await stand.viewer.settled();
    }

    /** Returns the largest difference of two pictures within one tile's ball. */
    function apartIn(tile: string, a: Picture, b: Picture): number {
      const { x, y, radius } = spot(a, stand.manifest, centerOf(tile));
      let farthest = 0;
      for (let dy = -Math.ceil(1.4 * radius); dy <= 1.4 * radius; dy++) {
        for (let dx = -Math.ceil(1.4 * radius); dx <= 1.4 * radius; dx++) {
          if (Math.hypot(dx, dy) >= 1.4 * radius) continue;
          farthest = Math.max(farthest, apart(a, b, x + dx, y + dy));
        }
      }
      return farthest;
    }

    it("opens with a tile as its volume and no surface, one as both, the others as surfaces", async () => {
      await stand.open(UNSHADED); // a new page, because this test is about the opening
      isOpen = true;
      await stand.viewer.show("Slab", false);
      await stand.viewer.show("Sheet", false);
      const opened = await takePicture(stand.viewer.page);
      const [surface, volume] = ["surface", "volume"].map((as) => remembered(`balls as a ${as}`));
      expect(apartIn(AS_VOLUME, opened, volume)).toBeLessThanOrEqual(2);
      expect(apartIn(AS_VOLUME, opened, surface)).toBeGreaterThan(20);
      expect(apartIn(PLAIN, opened, surface)).toBeLessThanOrEqual(2);
      expect(apartIn(PLAIN, opened, volume)).toBeGreaterThan(20);
      expect(apartIn(AS_BOTH, opened, surface)).toBeGreaterThan(20);
      expect(apartIn(AS_BOTH, opened, volume)).toBeGreaterThan(20);
      const { volumes } = await stand.viewer.snapshot();
      expect(volumes.map(({ tile }) => tile).sort()).toEqual([AS_BOTH, AS_VOLUME]);

      // The user's choice overrides the layer.
      await stand.viewer.drawVolume("Balls", false);
      const asked = await takePicture(stand.viewer.page);
      expect(apartIn(AS_VOLUME, asked, surface)).toBeLessThanOrEqual(2);
      expect(apartIn(AS_BOTH, asked, surface)).toBeLessThanOrEqual(2);
    });

    it.each(["surface", "volume"] as const)(
      "recolours the balls, hides one and moves another, as a %s, and leaves the others",
      async (as) => {
        await openOnce();
        const before = remembered(`balls as a ${as}`);
        const after = await only(stand, "Balls", as);
        const at = (point: Vec3) => spot(after, stand.manifest, point);
        const [hidden, old, moved] = [
          at(centerOf(HIDDEN)),
          at(centerOf(MOVED)),
          at(plus(centerOf(MOVED), MOVE_UM)),
        ];
        // The moved ball covers neither the upper half of the gap nor the lower half of its own old place.
        for (const share of [0.3, 0.6, 0.9]) {
          expect(isDrawn(before, hidden.x, hidden.y - share * hidden.radius)).toBe(true);
          expect(isDrawn(after, hidden.x, hidden.y - share * hidden.radius)).toBe(false);
          expect(isDrawn(before, old.x, old.y + share * old.radius)).toBe(true);
          expect(isDrawn(after, old.x, old.y + share * old.radius)).toBe(false);
        }
        const [from, to] = [blob(before, old), blob(after, moved)];
        expect(Math.abs(to.x - from.x - (moved.x - old.x)), "pixels to the right").toBeLessThan(1);
        expect(Math.abs(to.y - from.y - (moved.y - old.y)), "pixels down").toBeLessThan(1);
        expect(to.area / from.area).toBeGreaterThan(0.97);
        expect(to.area / from.area).toBeLessThan(1.03);

        // All other pixels equal those after choosing the colour in the panel.
        let [shared, farthest] = [0, 0];
        for (let y = 0; y < after.height; y++) {
          for (let x = 0; x < after.width; x++) {
            if (isTouched(after, x, y)) continue;
            if (hasColor(COLOR)(after.at(x, y))) shared++;
            farthest = Math.max(farthest, apart(before, after, x, y));
          }
        }
        expect(shared).toBeGreaterThan(5000);
        expect(farthest).toBeLessThanOrEqual(2);
      },
    );

    it("draws a tile at the chosen level of detail, and the others at the level for the view", async () => {
      await openOnce();
      await chooseQuality("high");
      const picture = await only(stand, "Balls", "surface");
      const drawn = [AS_BOTH, AS_VOLUME, COARSE, MOVED, PLAIN].map((tile) =>
        trianglesOf(BUILT, tile, tile === COARSE ? COARSE_LOD : DUE_LOD),
      );
      const sum = (await Promise.all(drawn)).reduce((a, b) => a + b, 0);
      expect((await stand.viewer.snapshot()).triangles).toBe(sum);
      expect(apartIn(COARSE, picture, remembered("balls as a surface"))).toBeGreaterThan(40);
      await chooseQuality("low");
    });

    it("draws the slab as opaque as the opacity points that the stage's edit gave it", async () => {
      await openOnce();
      await only(stand, "Slab", "volume");
      await stand.viewer.recolor("Slab", "#ffffff");
      const picture = await takePicture(stand.viewer.page);
      const point = centerOf("r1_c0");
      const { specimen } = stand.manifest;
      const { cosine } = project(point, specimen.bounds_um, picture.width, picture.height);
      const expected = 1 - (1 - SLAB_OPACITY) ** (SLAB_VOXELS / cosine);
      const at = spot(picture, stand.manifest, point);
      const [found, facing] = [lightAt(picture, at), lightFacing(picture, at)];
      // Inside, apart from its faces, the slab is lit like a medium without a boundary.
      expect(Math.abs(found / (SCATTERED * facing) - expected)).toBeLessThan(0.02);
    });

    it("opens with the transfer function of the chosen variant", async () => {
      await openOnce();
      const chosen = await only(stand, "Sheet", "volume");
      // A tile that was neither hidden nor moved looks the same as after choosing the function in the panel.
      const { x, y, radius } = spot(chosen, stand.manifest, centerOf("r1_c0"));
      const steps = [-0.9, -0.6, -0.3, 0, 0.3, 0.6, 0.9].map((share) => share * radius);
      const farthest = (name: string) =>
        Math.max(
          ...steps.flatMap((dx) =>
            steps.map((dy) => apart(chosen, remembered(name), x + dx, y + dy)),
          ),
        );
      expect(farthest("chosen sheet")).toBeLessThanOrEqual(2);
      expect(farthest("sheet")).toBeGreaterThan(40);
    });
  });
});
