/** The share link in headless Chromium: opening it shows the same view. */
import { expect, it } from "vitest";
import type { Snapshot } from "../../src/host/snapshot";
import { START_VOLUMES } from "../../src/state/parameters/volumes";
import { addHeadset } from "../support/browser/chromium";
import { difference, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const F = "F_x20_body";
/** Share of pixels that may differ, in addition to those that blend differently each time they are drawn. */
const SAME = 0.002;
/** The same share in a headset, where frames are drawn within a time limit, and some are coarser. */
const SAME_IN_HEADSET = 0.008;

describeInChromium("the share link", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 270 } });
  const page = () => stand.viewer.page;
  const announced = () => page().locator("[data-announcement]").textContent();

  /** Returns the parts of a state that belong to a view; notices and the order of showing do not. */
  function viewOf({ state }: Snapshot) {
    const { notices, channels, ...rest } = state;
    return { ...rest, channels: channels.map(({ turn, ...channel }) => channel) };
  }

  it("restores state and picture in another page", async () => {
    await stand.open("&mode=tile&disc=20");
    const { viewer } = stand;
    await viewer.settled();
    await viewer.turnLeftSideToFront();
    await viewer.recolor(F, "#ff00ff");
    await viewer.show("Balls", false);
    await viewer.openCard(F);
    await viewer.slide(`${F}/opacity`, 0.5);
    await viewer.chooseTile("r0_c0");
    await viewer.chooseMode("all");
    for (const key of ["n", "j", "p"]) await page().keyboard.press(key);
    await viewer.still();
    const address = await viewer.writeLink();
    await viewer.still();
    const [before, picture] = [viewOf(await viewer.snapshot()), await takePicture(page())];
    expect(address).toContain("#v=1&");
    // A setting of the address is now part of the link's view.
    expect(new URL(address).search).toBe("?bundle=..%2Fbundle%2F");
    expect(address).toContain("&disc=20&");
    expect(await page().locator('[data-control="link"]').inputValue()).toBe(address);

    await page().goto("about:blank");
    await viewer.open(address);
    await viewer.still();
    expect(viewOf(await viewer.snapshot())).toEqual(before);
    expect((await viewer.snapshot()).state.notices).toEqual([]);
    expect(difference(picture, await takePicture(page()))).toBeLessThan(SAME);
  });

  it("brings a view that was made in a headset to the screen, and to another headset", async () => {
    const press = async (...keys: readonly string[]) => {
      for (const key of keys) await page().keyboard.press(key);
      await stand.viewer.settled();
    };
    /** Eye and specimen in the link. */
    const written = async (): Promise<readonly number[]> => {
      const link = new URL(await stand.viewer.writeLink()).hash;
      const parts = new URLSearchParams(link.slice(1));
      return ["eye", "pose"].flatMap((name) => parts.get(name)?.split(",").map(Number) ?? []);
    };
    /** Waits until announcements in front of the eyes have disappeared. */
    const silent = () => expect.poll(noticesInView).toEqual([]);
    /** Waits until the name of the part under the gaze is shown. */
    const rested = () => page().waitForTimeout(1500);
    const noticesInView = async () => (await stand.viewer.snapshot()).stereoNotices;
    const expectSame = (found: readonly number[], wanted: readonly number[]) => {
      expect(found).toHaveLength(wanted.length);
      found.forEach((value, i) => {
        expect(value).toBeCloseTo(wanted[i], 4);
      });
    };
    await addHeadset(page());
    await stand.open("&mode=off");
    await press("ArrowRight", "ArrowRight", "ArrowDown", "Shift+ArrowRight", "j");
    const flat = await written();
    await stand.viewer.enterStereo();
    await silent();
    const unmoved = await takePicture(page());
    expectSame(await written(), flat); // the specimen was not moved in the headset
    await press("ArrowRight", "+");
    await silent();
    await rested();
    const inHeadset = await takePicture(page());
    expect(difference(unmoved, inHeadset)).toBeGreaterThan(4 * SAME_IN_HEADSET);
    const moved = await written();
    expect(moved).toHaveLength(flat.length + 8);
    expect(moved.slice(0, 6)).toEqual(flat.slice(0, 6));
    // The specimen is nearer by a fifth of the 1.1 m in a headset, and not by the 1.1 m themselves.
    expect(Math.hypot(...moved.slice(6, 9))).toBeLessThan(0.2 + 0.2 * 1.1);
    const address = page().url();

    await press("V");
    await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(false);
    await stand.viewer.still();
    expectSame(await written(), moved); // changes that were made in the headset stay
    await silent();
    const left = await takePicture(page());

    await page().goto("about:blank");
    await stand.viewer.open(address);
    await stand.viewer.still();
    expect(difference(left, await takePicture(page()))).toBeLessThan(SAME);
    await stand.viewer.enterStereo();
    await rested();
    expect(difference(inHeadset, await takePicture(page()))).toBeLessThan(SAME_IN_HEADSET);
    expectSame(await written(), moved);
  });

  it("goes to the clipboard, and is announced", async () => {
    await page().context().grantPermissions(["clipboard-read", "clipboard-write"]);
    await stand.open();
    await page().keyboard.press("d");
    await page().keyboard.press("l");
    await expect.poll(announced).toBe("The link is in the clipboard.");
    const copied = await page().evaluate(() => navigator.clipboard.readText());
    expect(copied).toBe(page().url());
    expect(copied).toContain(`disc=${START_VOLUMES.discRadius_deg - 1}`);
  });

  it("is selected in a field if the browser refuses access to the clipboard", async () => {
    await page().addInitScript(() => {
      Object.defineProperty(navigator, "clipboard", { value: undefined });
    });
    await stand.open();
    await page().keyboard.press("l");
    await expect.poll(announced).toContain("selected");
    expect(await page().evaluate(() => getSelection()?.toString())).toBe(page().url());
  });

  it("applies the known parts of a link to another bundle, and reports the missing ones", async () => {
    await stand.open("#v=1&c=Balls,CD8&tile=r7_c7&disc=9&box=NaN");
    const { state } = await stand.viewer.snapshot();
    expect(state.channels.filter(({ shown }) => shown).map(({ id }) => id)).toEqual(["Balls"]);
    expect(state.discRadius_deg).toBe(9);
    expect(await page().locator("[data-notices]").textContent()).toMatch(
      /no channel CD8, tile r7_c7\..*can't be read: box/,
    );
  });

  it("opens when pasted over another view of the same page", async () => {
    await stand.open();
    expect((await stand.viewer.snapshot()).state.discRadius_deg).not.toBe(33);
    await page().evaluate(() => {
      location.hash = "#v=1&disc=33";
    });
    await expect
      .poll(async () => (await stand.viewer.snapshot().catch(() => null))?.state.discRadius_deg)
      .toBe(33);
  });
});
