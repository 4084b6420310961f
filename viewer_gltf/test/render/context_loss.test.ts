/** What the graphics driver does to the page: it drops the picture, or draws smaller textures. */
import { expect, it } from "vitest";
import { difference, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

describeInChromium("the graphics driver", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 270 } });
  const notices = async () => (await stand.viewer.snapshot()).state.notices;

  it("drops the picture, which is drawn anew: surfaces and volumes", async () => {
    await stand.viewer.page.addInitScript(() => {
      const original = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, ...given) {
        const made = (original as (...each: unknown[]) => unknown).apply(this, given);
        if (made instanceof WebGL2RenderingContext) Object.assign(window, { drawnBy: made });
        return made as never;
      };
    });
    const warnings: string[] = [];
    stand.viewer.page.on("console", (message) => {
      if (message.type() === "warning") warnings.push(message.text());
    });
    await stand.open("&mode=tile&switch=9&quality=high");
    await stand.viewer.chooseTile("r0_c1");
    const before = await takePicture(stand.viewer.page);
    const call = (name: "loseContext" | "restoreContext") =>
      stand.viewer.page.evaluate((each) => {
        const held = window as unknown as {
          drawnBy: WebGL2RenderingContext;
          loss?: WEBGL_lose_context | null;
        };
        held.loss ??= held.drawnBy.getExtension("WEBGL_lose_context");
        held.loss?.[each]();
      }, name);
    await call("loseContext");
    await expect.poll(notices).toEqual([expect.stringContaining("dropped the picture")]);
    await call("restoreContext");
    await expect.poll(notices).toEqual([]);
    await stand.viewer.settled();
    expect(difference(before, await takePicture(stand.viewer.page))).toBeLessThan(0.002);
    const { volumes } = await stand.viewer.snapshot();
    expect(volumes.every(({ level }) => level === 0)).toBe(true);
    // nothing is drawn while there is nothing to draw on, nor dropped what belongs to another
    expect(warnings.filter((text) => /TilesRenderer|does not belong/.test(text))).toEqual([]);
  });

  it("takes no large textures: a coarser level is shown, and the page reports it", async () => {
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
      expect.stringMatching(/at most 64 voxels along an edge: those of \d+ are shown at a coarser/),
    ]);
    const { volumes } = await stand.viewer.snapshot();
    expect(volumes.length).toBeGreaterThan(0);
    expect(volumes.every(({ level }) => level !== null && level > 0)).toBe(true);
  });
});
