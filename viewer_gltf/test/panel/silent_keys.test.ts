/** Every key in headless Chromium, in several states: something is seen to change, or is said. */
import { expect, it } from "vitest";
import { UNCHANGED_VIEW } from "../../src/state/commands";
import { REFUSED } from "../../src/state/refusals";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";
import { KEYS, NO_SLICES } from "../support/panel/all_keys";

const SCREEN = { viewport: { width: 320, height: 240 }, isBlind: true };
/** They open a dialog of the browser's own, fill the screen, save a file or take long: tests of their own have them. */
const LEFT_OUT: readonly string[] = ["Shift+Enter", "U", "K", "(", "Insert", '"', ")", "l", "P"];
const NAMES = KEYS.groups
  .flatMap(({ keys }) => keys.flatMap(({ keys }) => keys))
  .filter((name) => !LEFT_OUT.includes(name));

const OPENED = "as it opens";
const STATES: Readonly<Record<string, readonly string[]>> = {
  [OPENED]: [],
  "with everything off": ["m", "m", "m", "m", "1", "2", "3"],
  "after the same key": [],
  "with slices, cuts and the tool": ["\\", "b", "n", "p", "t", "i"],
};
const SWEPT = sweep(Object.entries(STATES), ([name]) => name === OPENED);

describeInChromium("every key", () => {
  const stand = prepareStand(SCREEN);

  /**
   * All that a person can perceive of the page, but for what changes by itself, and what is said. `isBefore`: of a
   * key, with nothing said or open; else a frame after it.
   */
  const perceived = (isBefore: boolean) =>
    stand.viewer.page.evaluate(async (isBefore) => {
      const line = document.querySelector("[data-said]");
      if (isBefore) {
        if (line !== null) line.textContent = "";
        if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
        for (const open of document.querySelectorAll("dialog")) open.close();
      } else await new Promise(requestAnimationFrame);
      const { state, look } = window.stereocell?.snapshot() ?? {};
      const dialogs = document.querySelectorAll("dialog[open]").length;
      const panel = document.querySelector(".panel");
      const isBodyShown = (panel?.querySelector(".body") as HTMLElement | null)?.checkVisibility();
      const marks = [...(panel?.querySelectorAll("[aria-expanded], [aria-pressed]") ?? [])].map(
        (each) => `${each.ariaExpanded}${each.ariaPressed}`,
      );
      const focused = (document.activeElement as HTMLElement | null)?.dataset.control;
      const isFull = document.fullscreenElement !== null;
      const seen = JSON.stringify({ state, look, dialogs, isBodyShown, marks, focused, isFull });
      return { seen, said: line?.textContent ?? "" };
    }, isBefore);

  it.each(SWEPT)("says or shows something: %s", async (where, before) => {
    const { viewer } = stand;
    await stand.open();
    const { page } = viewer;
    for (const key of before) await page.keyboard.press(key);
    const silent: string[] = [];
    for (const name of NAMES) {
      if (where === "after the same key" && name !== "?") {
        for (let i = 0; i < 3; i++) await page.keyboard.press(name.replace("Ctrl", "Control"));
      }
      const was = await perceived(true);
      await page.keyboard.press(name.replace("Ctrl", "Control"));
      const isSilent = async () => {
        const { seen, said } = await perceived(false);
        return said === "" && seen === was.seen;
      };
      // what asks a worker, or for a part of the page, is answered a little later
      for (let left = 20; left > 0 && (await isSilent()); left--) await page.waitForTimeout(100);
      if (await isSilent()) silent.push(name);
    }
    expect(silent).toEqual([]);
  });

  it("says of a key that there is none, and how to find all", async () => {
    await stand.open();
    const { page } = stand.viewer;
    const said = () => page.locator("[data-said]").textContent();
    await page.evaluate(() => dispatchEvent(new KeyboardEvent("keydown", { key: "§" })));
    expect(await said()).toBe("No key §: ? lists the keys.");
    await page.keyboard.press("}");
    expect(await said()).toBe(NO_SLICES);
    await page.keyboard.press("]");
    expect(await said()).toBe("Only path tracing has this setting: switch path tracing on first.");
    await page.keyboard.press("u");
    expect(await said()).toBe(REFUSED.measured);
    await page.keyboard.press("z");
    await page.keyboard.press("z");
    expect(await said()).toBe(UNCHANGED_VIEW.front);
    for (let i = 0; i < 30; i++) await page.keyboard.press("+");
    expect(await said()).toBe(UNCHANGED_VIEW["zoom-in"]);
  });
});
