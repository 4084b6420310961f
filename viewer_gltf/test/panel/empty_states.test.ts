/** Messages of an empty view, and of refusals. STEREOCELL_SHOTS names a folder for screenshots. */
import { join } from "node:path";
import { beforeEach, expect, it } from "vitest";
import { REFUSED } from "../../src/state/refusals";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;

describeInChromium("the view", () => {
  const viewport = { width: 640, height: 480 };
  const stand = prepareStand({ viewport, isBlind: SHOTS === undefined });
  const page = () => stand.viewer.page;
  const message = () => page().locator("[data-view-message]");
  const backButton = () => page().locator('[data-action="way-back"]');
  const offer = () => page().locator('[data-action="offer"]');
  const announced = () => page().locator("[data-announcement]").textContent();
  const state = async () => (await stand.viewer.snapshot()).state;
  const press = (...keys: readonly string[]) =>
    keys.reduce((before, key) => before.then(() => page().keyboard.press(key)), Promise.resolve());

  beforeEach(async () => {
    await stand.open();
    await stand.viewer.settled();
  });

  it("reports that all channels are hidden, and shows them again by a button, which undo takes back", async () => {
    const shown = async () => (await state()).channels.map((channel) => channel.shown);
    const before = await shown();
    await press("1", "2", "3");
    await message().waitFor({ state: "visible" });
    expect(await message().textContent()).toContain("All channels are hidden.");
    if (SHOTS) await page().screenshot({ path: join(SHOTS, "empty_off.png") });
    await backButton().click();
    expect(await shown()).toEqual(before);
    await message().waitFor({ state: "hidden" });
    await press("Control+z");
    expect(await shown()).toEqual([false, false, false]);
    await message().waitFor({ state: "visible" });
  });

  it("reports that the cut removes everything, and removes the cut", async () => {
    await press("t", "i", "b", "t"); // the next tile, isolated, is outside the cut
    await message().waitFor({ state: "visible" });
    expect(await message().textContent()).toContain("The cut removes all of row 1, column 2.");
    await backButton().click();
    expect((await state()).clip).toEqual({ box: null, plane: null });
    await message().waitFor({ state: "hidden" });
  });

  it("reports that a tile has nothing of the shown channel, and shows all tiles", async () => {
    const has = async (tile: string) => {
      await press("Escape", "Escape");
      await stand.viewer.chooseTile(tile);
      await press("i");
      await stand.viewer.settled();
      return message().isVisible();
    };
    await stand.viewer.chooseMode("off");
    await stand.viewer.showOnly("F_x20_body"); // this channel lies only in the first tile
    expect(await has("r0_c0")).toBe(false);
    await has("r0_c1");
    await message().waitFor({ state: "visible" });
    if (SHOTS) await page().screenshot({ path: join(SHOTS, "empty_tile.png") });
    await backButton().click();
    await message().waitFor({ state: "hidden" });
  });

  it("reports why a pressed setting is refused, and offers to make it work", async () => {
    await stand.viewer.chooseMode("all");
    const radius = page().locator('[data-control="disc-radius"]');
    expect(await radius.isDisabled()).toBe(true);
    await page().locator(".slider", { has: radius }).click();
    expect(await announced()).toBe(REFUSED.disc);
    if (SHOTS) await page().screenshot({ path: join(SHOTS, "refused.png") });
    await offer().click();
    expect((await state()).mode).toBe("disc");
    expect(await announced()).toBe("");
    expect(await offer().isVisible()).toBe(false);
  });

  it("offers a tile if none is selected or gazed at", async () => {
    await press(...Array<string>(12).fill("-")); // beyond the volume distance
    await stand.viewer.still();
    await press("i");
    expect(await announced()).toBe(REFUSED.tile);
    await offer().click();
    const { isolated, middle } = await state();
    expect(isolated).toBe(middle);
  });
});
