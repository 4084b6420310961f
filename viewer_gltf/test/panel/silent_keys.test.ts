/** Every key in headless Chromium, in several states: each has a visible effect or an announcement. */
import { expect, it } from "vitest";
import { UNCHANGED_VIEW } from "../../src/state/commands";
import { REFUSED } from "../../src/state/refusals";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";
import { KEYS, NO_SLICES } from "../support/panel/all_keys";

const SCREEN = { viewport: { width: 320, height: 240 }, isBlind: true };
/**
 * Keys that open a dialog of the browser, fill the screen, save a file or take long. They have
 * tests of their own.
 */
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
   * Everything that a user can perceive of the page, except what changes by itself, and the
   * announcement.
   *
   * @param isBefore clears announcements and dialogs before a key; otherwise waits for a frame after it
   */
  const perceived = (isBefore: boolean) =>
    stand.viewer.page.evaluate(async (isBefore) => {
      const line = document.querySelector("[data-announcement]");
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
      return { seen, announced: line?.textContent ?? "" };
    }, isBefore);

  it.each(SWEPT)("announces or shows an effect: %s", async (where, before) => {
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
        const { seen, announced } = await perceived(false);
        return announced === "" && seen === was.seen;
      };
      // a response of a worker, or of code that is loaded, may come later
      for (let left = 20; left > 0 && (await isSilent()); left--) await page.waitForTimeout(100);
      if (await isSilent()) silent.push(name);
    }
    expect(silent).toEqual([]);
  });

  it("reports that a key does not exist, and how to find all keys", async () => {
    await stand.open();
    const { page } = stand.viewer;
    const announced = () => page.locator("[data-announcement]").textContent();
    await page.evaluate(() => dispatchEvent(new KeyboardEvent("keydown", { key: "§" })));
    expect(await announced()).toBe("§ is not a key of the viewer: ? lists the keys.");
    await page.keyboard.press("}");
    expect(await announced()).toBe(NO_SLICES);
    await page.keyboard.press("]");
    expect(await announced()).toBe(
      "Only path tracing has this setting: switch path tracing on first.",
    );
    await page.keyboard.press("u");
    expect(await announced()).toBe(REFUSED.measured);
    await page.keyboard.press("z");
    await page.keyboard.press("z");
    expect(await announced()).toBe(UNCHANGED_VIEW.front);
    for (let i = 0; i < 30; i++) await page.keyboard.press("+");
    expect(await announced()).toBe(UNCHANGED_VIEW["zoom-in"]);
  });
});
