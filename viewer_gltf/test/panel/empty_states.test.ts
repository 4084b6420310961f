/** What the picture says where it is empty, or where something is refused. STEREOCELL_SHOTS names a folder. */
import { join } from "node:path";
import { beforeEach, expect, it } from "vitest";
import { REFUSED } from "../../src/state/refusals";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;

describeInChromium("the picture", () => {
  const viewport = { width: 640, height: 480 };
  const stand = prepareStand({ viewport, isBlind: SHOTS === undefined });
  const page = () => stand.viewer.page;
  const message = () => page().locator("[data-view-message]");
  const wayBack = () => page().locator('[data-action="way-back"]');
  const offer = () => page().locator('[data-action="offer"]');
  const said = () => page().locator("[data-said]").textContent();
  const state = async () => (await stand.viewer.snapshot()).state;
  const press = (...keys: readonly string[]) =>
    keys.reduce((before, key) => before.then(() => page().keyboard.press(key)), Promise.resolve());

  beforeEach(async () => {
    await stand.open();
    await stand.viewer.settled();
  });

  it("says that all channels are hidden, and shows them again by one button, which undo takes back", async () => {
    const shown = async () => (await state()).channels.map((channel) => channel.shown);
    const before = await shown();
    await press("1", "2", "3");
    await message().waitFor({ state: "visible" });
    expect(await message().textContent()).toContain("All channels are hidden.");
    if (SHOTS) await page().screenshot({ path: join(SHOTS, "empty_off.png") });
    await wayBack().click();
    expect(await shown()).toEqual(before);
    await message().waitFor({ state: "hidden" });
    await press("Control+z");
    expect(await shown()).toEqual([false, false, false]);
    await message().waitFor({ state: "visible" });
  });

  it("says that the cut leaves nothing, and removes it", async () => {
    await press("t", "i", "b", "t"); // the next tile alone, beyond the cut
    await message().waitFor({ state: "visible" });
    expect(await message().textContent()).toContain("The cut removes all of row 1, column 2.");
    await wayBack().click();
    expect((await state()).clip).toEqual({ box: null, plane: null });
    await message().waitFor({ state: "hidden" });
  });

  it("says that a tile has nothing of the shown channel, and shows all tiles", async () => {
    const has = async (tile: string) => {
      await press("Escape", "Escape");
      await stand.viewer.chooseTile(tile);
      await press("i");
      await stand.viewer.settled();
      return message().isVisible();
    };
    await stand.viewer.chooseMode("off");
    await stand.viewer.showOnly("F_x20_body"); // which lies in the first tile alone
    expect(await has("r0_c0")).toBe(false);
    await has("r0_c1");
    await message().waitFor({ state: "visible" });
    if (SHOTS) await page().screenshot({ path: join(SHOTS, "empty_tile.png") });
    await wayBack().click();
    await message().waitFor({ state: "hidden" });
  });

  it("says why a setting is refused where it is pressed, and offers what makes it work", async () => {
    await stand.viewer.chooseMode("all");
    const radius = page().locator('[data-control="disc-radius"]');
    expect(await radius.isDisabled()).toBe(true);
    await page().locator(".slider", { has: radius }).click();
    expect(await said()).toBe(REFUSED.disc);
    if (SHOTS) await page().screenshot({ path: join(SHOTS, "refused.png") });
    await offer().click();
    expect((await state()).mode).toBe("disc");
    expect(await said()).toBe("");
    expect(await offer().isVisible()).toBe(false);
  });

  it("offers a tile where none is chosen or looked at", async () => {
    await press(...Array<string>(12).fill("-")); // beyond the distance of near tiles
    await stand.viewer.still();
    await press("i");
    expect(await said()).toBe(REFUSED.tile);
    await offer().click();
    const { isolated, middle } = await state();
    expect(isolated).toBe(middle);
  });
});
