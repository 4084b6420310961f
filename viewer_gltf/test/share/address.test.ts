/** The page's address follows the view in headless Chromium, so that a reload restores the view. */
import { expect, it } from "vitest";
import type { Snapshot } from "../../src/host/snapshot";
import { difference, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

/** Share of pixels that may differ, in addition to those that blend differently each time they are drawn. */
const SAME = 0.002;
/** Wait, ms; longer than the view has to rest before the address follows. */
const CALM_MS = 2500;

describeInChromium("the address", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 270 } });
  const page = () => stand.viewer.page;
  const hash = () => page().evaluate(() => location.hash);
  const calm = () => page().waitForTimeout(CALM_MS);

  /** The parts of a state that a view is made of; notices and the order of showing are not. */
  function viewOf({ state, look }: Snapshot) {
    const { notices, channels, ...rest } = state;
    const rounded = [...look.position, ...look.target].map((v) => Number(v.toFixed(4)));
    return { ...rest, channels: channels.map(({ turn, ...channel }) => channel), rounded };
  }

  const reload = async () => {
    await page().reload();
    await page().waitForFunction(() => window.stereocell !== undefined);
    await page().evaluate(() => window.stereocell?.ready);
    await stand.viewer.still();
  };

  it("stays as it is until the view changes, and returns with the opening view", async () => {
    await stand.open("&mode=off");
    const opened = page().url();
    await calm();
    expect(page().url()).toBe(opened);
    await page().keyboard.press("ArrowRight");
    await expect.poll(hash).toContain("&eye=");
    await page().keyboard.press("z"); // the front view, with which the page has opened
    await expect.poll(() => page().url()).toBe(opened);
  });

  it("keeps the view over a reload: channels, tile, cut, measurements, camera", async () => {
    await stand.open("&mode=tile&disc=20");
    const { viewer } = stand;
    await viewer.settled();
    await viewer.recolor("Block", "#ff00ff");
    await viewer.show("Balls", false);
    await viewer.chooseTile("r0_c0");
    for (const key of ["n", "j", "p", "ArrowRight", "ArrowDown", "+"]) {
      await page().keyboard.press(key);
    }
    await viewer.still();
    const [before, picture] = [viewOf(await viewer.snapshot()), await takePicture(page())];
    await expect.poll(hash).toContain("tile=r0_c0");
    await calm();
    const address = page().url();
    await reload();
    expect(viewOf(await viewer.snapshot())).toEqual(before);
    expect((await viewer.snapshot()).state.notices).toEqual([]);
    expect(difference(picture, await takePicture(page()))).toBeLessThan(SAME);
    await calm();
    expect(page().url()).toBe(address);
  });

  it("adds no steps to the history: one step back leaves the page", async () => {
    await page().goto(`${stand.host.address}/bundle/manifest.json`);
    await stand.open("&mode=off");
    for (const key of ["ArrowRight", "ArrowUp", "+"]) {
      await page().keyboard.press(key);
      const before = await hash();
      await expect.poll(hash).not.toBe(before);
    }
    await page().goBack();
    expect(page().url()).toBe(`${stand.host.address}/bundle/manifest.json`);
  });

  it("leaves out text that a user has typed, and a reload keeps that text", async () => {
    await stand.open("&mode=off#v=1&measures=d:Distance%201:1,-1,1,5,-1,1");
    await stand.viewer.settled();
    await stand.viewer.unfold("measure");
    const name = page().locator('[data-control="measurement-0-name"]');
    await name.fill("Doe, Jane");
    await name.press("Enter");
    const names = async () =>
      (await stand.viewer.snapshot()).state.measurements.map((each) => each.name);
    expect(await names()).toEqual(["Doe, Jane"]);
    await page().keyboard.press("Escape");
    await page().locator(".stage canvas").click();
    await page().keyboard.press("ArrowRight");
    await expect.poll(hash).toContain("&eye=");
    expect(page().url()).not.toContain("Doe");
    await reload();
    expect(await names()).toEqual(["Doe, Jane"]);
  });

  it("is replaced by a link that is pasted over it", async () => {
    await stand.open("&mode=off");
    await page().keyboard.press("ArrowRight");
    await expect.poll(hash).toContain("&eye=");
    await page().keyboard.press("ArrowRight");
    await page().evaluate(() => {
      location.hash = "#v=1&disc=33";
    });
    const radius = async () =>
      (await stand.viewer.snapshot().catch(() => null))?.state.discRadius_deg;
    await expect.poll(radius).toBe(33);
    await calm();
    expect(await hash()).toBe("#v=1&disc=33");
  });

  it("stays as it is in the split screen, also while the page waits for the phone's rotation", async () => {
    await stand.open("&mode=off");
    await page().setViewportSize({ width: 270, height: 480 });
    await page().evaluate(() => Object.assign(window, { isSamePage: true }));
    await calm();
    await page().keyboard.press("P");
    await page().keyboard.press("ArrowRight");
    const before = await hash();
    await calm();
    expect(await hash()).toBe(before);
    await page().keyboard.press("Escape");
    await expect.poll(hash).toContain("&eye=");
    expect(await page().evaluate(() => "isSamePage" in window)).toBe(true);
  });

  it("stays as it is in a frame without a panel, unless the address requests that it follows", async () => {
    const turnIn = async (query: string) => {
      await page().setContent(
        `<iframe width="400" height="240" src="${stand.host.address}/app/?bundle=../bundle/&quality=low&mode=off${query}"></iframe>`,
      );
      const frame = page().frames()[1];
      await frame.waitForFunction(() => window.stereocell !== undefined);
      await frame.evaluate(() => window.stereocell?.ready);
      await frame.locator(".stage canvas").click();
      await page().keyboard.press("ArrowRight");
      return frame;
    };
    await page().goto(`${stand.host.address}/bundle/manifest.json`);
    const picture = await turnIn("&panel=off");
    await calm();
    expect(new URL(picture.url()).hash).toBe("");
    const follower = await turnIn("&panel=off&address=on");
    await expect.poll(() => new URL(follower.url()).hash).toContain("&eye=");
  });
});
