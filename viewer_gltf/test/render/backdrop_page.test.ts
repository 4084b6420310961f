/**
 * The backdrop on a flat screen: gradient and shadow, light and dark theme; the specimen's colours
 * do not change.
 */
import { expect, it } from "vitest";
import { type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

/** Largest difference of a colour component, of 255, between two images of the same surface. */
const SAME = 3;

describeInChromium("the background on a flat screen", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 360 }, pixelRatio: 1 });

  /** An image of the surfaces, from slightly above, in a theme. */
  async function pictureIn(theme: string, query = ""): Promise<Picture> {
    await stand.viewer.page.emulateMedia({ contrast: "no-preference" });
    await stand.open(`&mode=off&view=opening&theme=${theme}&quality=high${query}`);
    await stand.viewer.settled();
    return takePicture(stand.viewer.page);
  }

  const light = (picture: Picture, x: number, y: number) =>
    picture.at(x, y).reduce((sum, v) => sum + v, 0);

  it("is lighter beside the specimen than in its shadow, in both themes", async () => {
    for (const theme of ["dark", "light"]) {
      const [room, plain] = [await pictureIn(theme), await pictureIn(theme, "&backdrop=plain")];
      const ground = plain.at(1, 1);
      // the specimen is where the plain image differs from its single background colour
      const bare = plain.where((pixel) => pixel.join() === ground.join());
      const lights = bare.map(([x, y]) => light(room, x, y));
      const [darkest, lightest] = [Math.min(...lights), Math.max(...lights)];
      const far = light(room, 1, 1);
      expect(lightest - darkest, theme).toBeGreaterThan(25);
      expect(darkest, theme).toBeLessThan(far);
      // the darkest place lies below the middle, under the specimen
      const [, row] = bare[lights.indexOf(darkest)];
      expect(row / room.height, theme).toBeGreaterThan(0.5);
    }
  });

  it("has the shadow of the shown part, and none if nothing is shown", async () => {
    const { viewer, manifest } = stand;
    const whole = await pictureIn("light");
    const sky = light(whole, 1, 1);
    const shaded = (picture: Picture) =>
      picture.where((pixel) => {
        const [least, most] = [Math.min(...pixel), Math.max(...pixel)];
        return most - least < 24 && pixel.reduce((sum, v) => sum + v, 0) < sky - 90;
      });
    const places = shaded(whole);
    expect(places.length).toBeGreaterThan(100);
    const lightThere = (picture: Picture) => {
      const lights = places.map(([x, y]) => light(picture, x, y)).sort((a, b) => a - b);
      return lights[Math.floor(lights.length / 2)];
    };

    await viewer.chooseTile(manifest.tiles[0].id);
    await viewer.page.keyboard.press("i");
    await viewer.settled();
    expect((await viewer.snapshot()).state.isolated).not.toBe(null);
    expect(shaded(await takePicture(viewer.page)).length).toBeLessThan(places.length / 2);

    await viewer.page.keyboard.press("i");
    for (const { id } of manifest.channels) await viewer.show(id, false);
    expect(lightThere(await takePicture(viewer.page))).toBeGreaterThan(lightThere(whole) + 45);
  });

  it("does not change the specimen's colours", async () => {
    const pictures = [
      await pictureIn("dark"),
      await pictureIn("light"),
      await pictureIn("dark", "&backdrop=plain"),
    ];
    const isInside = ([r, g, b]: readonly number[]) => Math.max(r, g, b) - Math.min(r, g, b) > 60;
    const near = [-2, -1, 0, 1, 2];
    // pixels at edges are left out, since they mix specimen and background
    const inside = pictures[2]
      .where(isInside)
      .filter(([x, y]) =>
        near.every((u) => near.every((v) => isInside(pictures[2].at(x + u, y + v)))),
      );
    expect(inside.length).toBeGreaterThan(1000);
    for (const [x, y] of inside) {
      const [dark, light, plain] = pictures.map((picture) => picture.at(x, y));
      const apart = [light, plain].map((pixel) =>
        Math.max(...pixel.map((v, i) => Math.abs(v - dark[i]))),
      );
      expect(Math.max(...apart), `${x}, ${y}`).toBeLessThanOrEqual(SAME);
    }
  });

  it("is the same in each run", async () => {
    const [first, again] = [await pictureIn("light"), await pictureIn("light")];
    const differing = first
      .where(() => true)
      .filter(([x, y]) => first.at(x, y).join() !== again.at(x, y).join());
    expect(differing).toEqual([]);
  });

  it("follows the system's theme if the address names none", async () => {
    const { page } = stand.viewer;
    await page.emulateMedia({ colorScheme: "light", contrast: "no-preference" });
    await stand.open("&mode=off");
    const themeOf = () => page.evaluate(() => document.documentElement.dataset.theme);
    expect(await themeOf()).toBe("light");
    await page.emulateMedia({ colorScheme: "dark" });
    await expect.poll(themeOf).toBe("dark");
  });
});
