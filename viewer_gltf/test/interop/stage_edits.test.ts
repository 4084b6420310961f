/** The viewer shows the edits that an artist makes in a layer over the stage; tests/support/edited_bundle.py makes them. */
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, expect, it } from "vitest";
import { hasColor, isBackground, type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { askPython, hasPython } from "../support/python";

// The same values as in tests/support/edited_bundle.py.
const OPACITY = 0.4;
const EMISSION = [0, 0.4, 0] as const;
const TILE_NAME = "Left half";

/** Returns the linear light of an 8-bit sRGB value, 0..1. */
const linear = (v: number) => (v > 10 ? ((v / 255 + 0.055) / 1.055) ** 2.4 : v / 255 / 12.92);

describeInChromium("edits of a stage", () => {
  if (!hasPython) {
    it.skip("needs Python");
    return;
  }
  const folder = mkdtempSync(join(tmpdir(), "stereocell-edits-"));
  beforeAll(() => askPython("edited_bundle", [folder], ""));
  afterAll(() => rmSync(folder, { recursive: true, force: true }));
  const stand = prepareStand({
    viewport: { width: 320, height: 200 },
    pixelRatio: 1,
    bundle: join(folder, "built"),
    mounts: () => ({ "/edits/": folder }),
  });

  /** Returns a picture of only the surfaces from the front; `query` is appended to the bundle's address. */
  async function look(name: string, query = ""): Promise<Picture> {
    await stand.viewer.open(
      `${stand.host.address}/app/?bundle=../edits/${name}/&view=front&mode=off${query}#v=1&depth=0`,
    );
    await stand.viewer.settled();
    return takePicture(stand.viewer.page);
  }

  it("shows a channel with the opacity that the stage states", async () => {
    const [opaque, clear] = [await look("built"), await look("translucent")];
    const [x, y] = [opaque.width / 2 - 8, opaque.height / 2 - 8];
    const behind = clear.at(4, opaque.height / 2);
    const [full, part] = [opaque.at(x, y).map(linear), clear.at(x, y).map(linear)];
    expect(full[0]).toBeGreaterThan(0.1);
    part.forEach((light, i) => {
      const wanted = OPACITY * full[i] + (1 - OPACITY) * linear(behind[i]);
      expect(Math.abs(light - wanted)).toBeLessThan(0.02);
    });
  });

  it("calls a tile by the name that the stage gives it", async () => {
    await look("named");
    const label = await stand.viewer.page.locator('[data-tile-choice="r0_c0"]').ariaSnapshot();
    expect(label).toContain(TILE_NAME);
  });

  it("leaves out a tile that is a guide in the stage", async () => {
    await look("guide");
    const { state } = await stand.viewer.snapshot();
    expect(state.tiles.map(({ id }) => id)).toEqual(["r0_c1"]);
  });

  it("shows the views of the stage's cameras by name and in order", async () => {
    await look("framed");
    const next = async (name: string) => {
      const button = { name: `Next kept view: ${name}` };
      await stand.viewer.page.getByRole("button", button).click({ force: true });
      await stand.viewer.settled();
      const { look } = await stand.viewer.snapshot();
      return { look, picture: await takePicture(stand.viewer.page) };
    };
    const side = await next("From the side");
    expect(side.look.position[0]).toBeGreaterThan(Math.abs(10 * side.look.position[2]));
    const front = await next("From the front");
    // The stage camera's view is 8 um high at the centre of the sphere, whose radius is 3.5 um. The viewer's camera has
    // another field of view, and shows the same height from nearer.
    const half = Math.tan((20 * Math.PI) / 180);
    const wanted = Math.tan(Math.asin(3.5 / (4 / half))) / half;
    const shown = front.picture.where((pixel) => !isBackground(pixel));
    const high = Math.max(...shown.map(([, y]) => y)) - Math.min(...shown.map(([, y]) => y));
    expect(Math.abs(high / front.picture.height - wanted)).toBeLessThan(0.015);
  });

  it("shows the additions of a layer at their places, and hides them by name", async () => {
    const isBlue = hasColor([0, 0, 1]);
    expect((await look("built")).count(isBlue)).toBe(0);
    const shown = (await look("added")).where(isBlue);
    expect(shown.length).toBeGreaterThan(100);
    // The arrow is above the sphere's centre. Its height is that of the specimen's upper half plus 9 um.
    const middle = shown.reduce((sum, [x]) => sum + x, 0) / shown.length;
    expect(Math.abs(middle - 160)).toBeLessThan(6);
    const label = await stand.viewer.page.evaluate(() => {
      const toggle = document.querySelector<HTMLElement>('[data-control="addition-0"]');
      toggle?.click();
      return toggle?.closest("label")?.textContent;
    });
    expect(label).toBe("Here");
    await stand.viewer.settled();
    expect((await takePicture(stand.viewer.page)).count(isBlue)).toBe(0);
  });

  it("shows what is inside a translucent surface, and not what is inside an opaque one", async () => {
    const names = ["built", "added", "translucent", "seen_through"] as const;
    const greens: number[] = [];
    for (const name of names) {
      const picture = await look(name);
      greens.push(linear(picture.at(picture.width / 2 - 8, picture.height / 2)[1]));
    }
    const [opaque, wireInOpaque, clear, wireInClear] = greens;
    expect(Math.abs(wireInOpaque - opaque)).toBeLessThan(0.01);
    expect(wireInClear - clear).toBeGreaterThan(0.1); // the wire is grey, and the sphere is red
  });

  it("adds the light that a channel emits", async () => {
    const [dark, bright] = [await look("built"), await look("glowing")];
    const [x, y] = [dark.width / 2 - 8, dark.height / 2 - 8];
    const [before, after] = [dark.at(x, y).map(linear), bright.at(x, y).map(linear)];
    before.forEach((light, i) => {
      expect(Math.abs(after[i] - light - EMISSION[i])).toBeLessThan(0.03);
    });
  });
});
