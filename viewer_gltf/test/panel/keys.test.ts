/** Keys that are pressed by accident can be taken back, and keys can be changed. */
import { expect, it } from "vitest";
import { isWritten } from "../../src/panel/key_events";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { KEYS } from "../support/panel/all_keys";

/**
 * Keys that open a dialog, a file chooser or stereo, or write a file or the clipboard. They need no
 * announcement.
 */
const OWN_ANSWER = ["?", "V", "P", "K", ":", "U", "l", "(", ")", '"', "R"];
const WRITTEN = KEYS.groups
  .flatMap(({ keys }) => keys.flatMap(({ keys }) => keys))
  .filter((name) => isWritten(name) && !OWN_ANSWER.includes(name));
/** Keys that bring the page into the states in which the others are tried. */
const STATES: Readonly<Record<string, readonly string[]>> = {
  "as it opens": [],
  "with slices, cuts, a kept view, a shape and one tile": [
    ...["ArrowRight", "\\", "|", "b", "n", "p", "H", "Q", "t", "i", "$"],
  ],
};

type Tried = Readonly<{ name: string; announced: string; changes: boolean; fault: string }>;

describeInChromium("a key that is pressed by accident", () => {
  const stand = prepareStand({ viewport: { width: 640, height: 480 }, isBlind: true });

  /** Presses each key once and undoes it. `changes` of a result: the key has changed something. */
  const tryAll = (names: readonly string[]) =>
    stand.viewer.page.evaluate(async (names): Promise<Tried[]> => {
      const line = document.querySelector<HTMLElement>("[data-announcement]");
      if (line === null) throw new Error("the page has no line");
      /** Leaves out loaded data, which is not a change by the user. */
      const comparable = (key: string, value: unknown) => {
        if (key === "transfer2d") return undefined;
        return typeof value === "number" ? value.toFixed(5) : value;
      };
      /** Returns the state, the camera and the open parts of the panel as text, to compare by. */
      const now = () => {
        const { state, look } = window.stereocell?.snapshot() ?? {};
        const panel = document.querySelector(".panel");
        const marks = [...(panel?.querySelectorAll("[aria-expanded], [aria-pressed]") ?? [])];
        return JSON.stringify(
          {
            ...{ state, look, isFolded: panel?.classList.contains("folded") },
            marks: marks.map((each) => `${each.ariaExpanded} ${each.ariaPressed}`),
          },
          comparable,
        );
      };
      const tried: Tried[] = [];
      for (const name of names) {
        (document.activeElement as HTMLElement | null)?.blur();
        const before = now();
        dispatchEvent(new KeyboardEvent("keydown", { key: name, cancelable: true }));
        await new Promise(requestAnimationFrame);
        const announced = line.textContent ?? "";
        const changes = now() !== before;
        const offer = document.querySelector<HTMLButtonElement>('[data-action="offer"]');
        const isOffered = offer?.textContent === "Undo"; // other offers are buttons of refusals
        if (isOffered) offer.click();
        await new Promise(requestAnimationFrame);
        const after = now();
        const at = [...before].findIndex((letter, i) => letter !== after[i]);
        const fault =
          after === before
            ? ""
            : `${isOffered ? "not exact" : "no offer"}: ${before.slice(at - 60, at + 60)} -> ${after.slice(at - 60, at + 60)}`;
        tried.push({ name, announced, changes, fault });
      }
      return tried;
    }, names);

  it.each(Object.entries(STATES))("is named and taken back exactly: %s", async (where, keys) => {
    await stand.open("&mode=disc");
    await stand.viewer.settled();
    const { page } = stand.viewer;
    for (const key of keys) await page.keyboard.press(key);
    await page.waitForTimeout(1100); // later changes are a step of their own
    const tried = await tryAll(WRITTEN);
    expect(tried.filter(({ fault }) => fault !== "")).toEqual([]);
    expect(tried.filter(({ announced }) => announced === "").map(({ name }) => name)).toEqual([]);
    // there are about ninety keys; the others report why they have no effect
    const few = where === "as it opens" ? 35 : 40;
    expect(tried.filter(({ changes }) => changes).length).toBeGreaterThan(few);
  });

  it("is taken back by Ctrl+Z too, with all that it changed", async () => {
    await stand.open("&mode=off");
    const { page } = stand.viewer;
    for (const key of ["t", "i", "ArrowRight"]) await page.keyboard.press(key);
    const { state, look } = await stand.viewer.snapshot();
    await page.keyboard.press("r"); // shows all tiles and turns the view
    expect((await stand.viewer.snapshot()).state.isolated).toBeNull();
    await page.keyboard.press("Control+z");
    const after = await stand.viewer.snapshot();
    expect(after.state.isolated).toBe(state.isolated);
    for (const i of [0, 1, 2]) expect(after.look.position[i]).toBeCloseTo(look.position[i], 5);
  });

  it("is no longer offered back once something else has changed", async () => {
    await stand.open("&mode=off");
    const { page } = stand.viewer;
    const undo = page.locator('[data-action="offer"]');
    await page.keyboard.press("o");
    expect(await undo.isVisible()).toBe(true);
    await stand.viewer.show("Balls", false);
    expect(await undo.isVisible()).toBe(false);
  });
});

describeInChromium("a key that a user changes", () => {
  const stand = prepareStand({ viewport: { width: 640, height: 480 }, isBlind: true });
  const page = () => stand.viewer.page;
  const opacity = async () => (await stand.viewer.snapshot()).state.channels[0].opacity;
  const line = () => page().locator("[data-key-line]").textContent();
  /** Presses a key that is on no keyboard of the test. */
  const pressOther = () =>
    page().evaluate(() =>
      (document.activeElement ?? document.body).dispatchEvent(
        new KeyboardEvent("keydown", { key: "§", bubbles: true, cancelable: true }),
      ),
    );
  const cap = (name: string) => page().locator(`[data-key="${name}"]`);

  it("is set in the list, kept for the next visit, refused if it is taken, and reset", async () => {
    await stand.open("&mode=off");
    const press = (key: string) => page().keyboard.press(key);
    await press("?");
    await cap("o").click();
    expect(await line()).toMatch(/^Press the new key for “.+”, or Esc to cancel\.$/);
    await press("x");
    expect(await line()).toBe(
      "That key is used for “Hide the channel”: press another key, or change that one first.",
    );
    await press("F5");
    expect(await line()).toMatch(/^That key belongs to the browser/);
    await pressOther();
    expect(await cap("o").textContent()).toBe("§");
    await press("Escape");
    await page().locator("dialog[data-help]").waitFor({ state: "hidden" });
    for (const isLater of [false, true]) {
      if (isLater) await stand.open("&mode=off");
      expect(await opacity()).toBe(1);
      await press("o");
      expect(await opacity()).toBe(1);
      await pressOther();
      expect(await opacity()).toBeCloseTo(0.95, 5);
      await press("Control+z");
    }
    await press("?");
    await page().locator('[data-action="reset-keys"]').click();
    expect(await cap("o").textContent()).toBe("o");
    await press("Escape");
    await page().locator("dialog[data-help]").waitFor({ state: "hidden" });
    await press("o");
    expect(await opacity()).toBeCloseTo(0.95, 5);
  });
});
