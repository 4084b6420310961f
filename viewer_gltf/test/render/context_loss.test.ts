/**
 * Effects of the graphics driver on the page: it loses the context, or supports only small
 * textures.
 */
import { expect, it } from "vitest";
import { changeContext, rememberContext } from "../support/browser/graphics_context";
import { difference, type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

/**
 * Pixels of a block's edge. Path-traced light is random, and the mean over a block evens it out.
 */
const BLOCK = 15;

/** Mean brightness of each block of an image, 0 to 255. */
function coarse(picture: Picture): readonly number[] {
  const { width, height } = picture;
  const across = Math.floor(width / BLOCK);
  return Array.from({ length: across * Math.floor(height / BLOCK) }, (_, block) => {
    const [left, top] = [BLOCK * (block % across), BLOCK * Math.floor(block / across)];
    const pixels = Array.from({ length: BLOCK ** 2 }, (_, i) =>
      picture.at(left + (i % BLOCK), top + Math.floor(i / BLOCK)),
    );
    return pixels.reduce((sum, [r, g, b]) => sum + (r + g + b) / 3, 0) / pixels.length;
  });
}

describeInChromium("a graphics driver", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 270 } });
  const notices = async () => (await stand.viewer.snapshot()).state.notices;

  const prepareLoss = () => rememberContext(stand.viewer.page);
  const call = (change: "loseContext" | "restoreContext") =>
    changeContext(stand.viewer.page, change);
  const loseAndRestore = async () => {
    await call("loseContext");
    await expect.poll(notices).toEqual([expect.stringContaining("dropped the view")]);
    await call("restoreContext");
    await expect.poll(notices).toEqual([]);
    await stand.viewer.settled();
  };

  it("drops the image, which is drawn again: surfaces and volumes", async () => {
    await prepareLoss();
    const warnings: string[] = [];
    stand.viewer.page.on("console", (message) => {
      if (message.type() === "warning") warnings.push(message.text());
    });
    await stand.open("&mode=tile&switch=9&quality=high");
    await stand.viewer.chooseTile("r0_c1");
    const before = await takePicture(stand.viewer.page);
    await loseAndRestore();
    expect(difference(before, await takePicture(stand.viewer.page))).toBeLessThan(0.002);
    const { volumes } = await stand.viewer.snapshot();
    expect(volumes.every(({ level }) => level === 0)).toBe(true);
    // nothing is drawn without a context, and no object of another context is deleted
    expect(warnings.filter((text) => /TilesRenderer|does not belong/.test(text))).toEqual([]);
  });

  it("drops the image, which is drawn again: slices, shaded volumes, a measurement and a clip", async () => {
    await prepareLoss();
    const cut = "cut=1,0,0,6&points=2,-2,1,8,-4,1&slices=on&planes=on&depth=0.5";
    await stand.open(`&mode=all#v=1&${cut}`);
    await stand.viewer.still();
    const before = await takePicture(stand.viewer.page);
    await loseAndRestore();
    await stand.viewer.still();
    expect(difference(before, await takePicture(stand.viewer.page))).toBeLessThan(0.002);
  });

  it("drops the image, which gathers light again", async () => {
    await prepareLoss();
    await stand.open("&mode=traced");
    const gathered = async () => {
      await expect.poll(async () => (await stand.viewer.snapshot()).traced.samples > 64).toBe(true);
      return takePicture(stand.viewer.page);
    };
    const before = await gathered();
    await loseAndRestore();
    const after = coarse(await gathered());
    coarse(before).forEach((value, i) => {
      expect(Math.abs(value - after[i]), `block ${i}`).toBeLessThan(12);
    });
  });

  it("does not restore the image: the page offers a reload with fewer pixels, which keeps the view", async () => {
    await prepareLoss();
    await stand.open("&mode=off");
    const { viewer } = stand;
    const width = () => viewer.page.evaluate(() => document.querySelector("canvas")?.width ?? 0);
    const look = async () => {
      const { position } = (await viewer.snapshot()).look;
      return position.map((v) => Number(v.toFixed(3)));
    };
    const offer = viewer.page.locator('[data-action="reload"]');
    await viewer.page.keyboard.press("ArrowRight");
    await viewer.still();
    const [before, seen] = [await width(), await look()];
    await call("loseContext");
    await offer.waitFor();
    expect(await notices()).toEqual([]); // the offer replaces the notice
    await call("restoreContext");
    await offer.waitFor({ state: "detached" }); // the context has returned after all
    await viewer.settled();
    await call("loseContext");
    await offer.click();
    await viewer.page.waitForFunction(
      (old) => (document.querySelector("canvas")?.width ?? old) < old && window.stereocell,
      before,
    );
    await viewer.page.evaluate(() => window.stereocell?.ready);
    expect(await width()).toBe(before / 2);
    expect(await look()).toEqual(seen);
    await expect
      .poll(() => viewer.page.locator("[data-announcement]").textContent())
      .toContain("fewer pixels");
    await viewer.page.evaluate(() => sessionStorage.clear()); // like another tab
    await viewer.page.reload();
    await expect.poll(width).toBe(before);
  });

  it("supports no large textures: a coarser level is shown, and the page reports it", async () => {
    await stand.viewer.page.addInitScript(() => {
      const { prototype } = WebGL2RenderingContext;
      const original = prototype.getParameter;
      prototype.getParameter = function (this: WebGL2RenderingContext, name: number) {
        return name === this.MAX_3D_TEXTURE_SIZE ? 64 : original.call(this, name);
      };
    });
    await stand.open("&mode=all");
    await stand.viewer.settled();
    expect(await notices()).toEqual([
      expect.stringMatching(
        /at most 64 voxels along an edge. Volumes of \d+ voxels are shown at a coarser/,
      ),
    ]);
    const { volumes } = await stand.viewer.snapshot();
    expect(volumes.length).toBeGreaterThan(0);
    expect(volumes.every(({ level }) => level !== null && level > 0)).toBe(true);
  });
});
