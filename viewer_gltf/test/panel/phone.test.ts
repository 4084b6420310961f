/** On phones, nothing lies under a notch, and the button back from a tile is within reach of the thumb. */
import { expect, it } from "vitest";
import { project } from "../support/browser/camera";
import { openAllSections } from "../support/browser/open_sections";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const UPRIGHT = { width: 390, height: 844 };
const LYING = { width: 844, height: 390 };
const DESK = { width: 900, height: 600 };
/** Safe-area insets of a phone with a notch, but on all sides at once, px. */
const INSETS = { top: 47, right: 44, bottom: 34, left: 44 };
/** Elements that must not lie under a notch: controls, and texts over the view. */
const PARTS =
  "button, select, input, canvas[role=application], .announcement, .first-hint, .notices p, .scale-bar, " +
  ".name-mark, .orientation-mark, .status, .panel h1, .way, dialog, .help header";

describeInChromium("a phone", () => {
  const stand = prepareStand({ viewport: UPRIGHT, hasTouch: true, isBlind: true });
  const page = () => stand.viewer.page;

  async function coverEdges(): Promise<void> {
    const devtools = await page().context().newCDPSession(page());
    await devtools.send(
      "Emulation.setSafeAreaInsetsOverride" as never,
      { insets: INSETS } as never,
    );
  }

  /** Elements that reach under the covered edges, within the visible part of their scroll containers. */
  const covered = () =>
    page().evaluate(
      ([parts, { top, right, bottom, left }]) =>
        [...document.querySelectorAll<HTMLElement>(parts)]
          .filter((each) => each.checkVisibility({ visibilityProperty: true }))
          .flatMap((each) => {
            const box = each.getBoundingClientRect();
            const seen = {
              ...{ top: box.top, left: box.left },
              right: box.right,
              bottom: box.bottom,
            };
            for (let at = each.parentElement; at !== null; at = at.parentElement) {
              if (!at.matches(".panel .body, .help .groups, .map, dialog")) continue;
              const { top, bottom } = at.getBoundingClientRect();
              seen.top = Math.max(seen.top, top);
              seen.bottom = Math.min(seen.bottom, bottom);
            }
            if (seen.bottom <= seen.top) return [];
            const isFree =
              seen.top >= top - 0.5 &&
              seen.left >= left - 0.5 &&
              seen.right <= innerWidth - right + 0.5 &&
              seen.bottom <= innerHeight - bottom + 0.5;
            const place = [seen.left, seen.top, seen.right, seen.bottom].map(Math.round).join();
            return isFree ? [] : [`${place}: ${each.outerHTML.slice(0, 100)}`];
          }),
      [PARTS, INSETS] as const,
    );

  it.each([
    ["upright", UPRIGHT, ""],
    ["lying", LYING, ""],
    ["at a desk", DESK, ""],
    ["without the panel", LYING, "&panel=off"],
    ["upright without the panel", UPRIGHT, "&panel=off"],
  ])("keeps all parts clear of the covered edges: %s", async (_, size, query) => {
    await page().setViewportSize(size);
    await coverEdges();
    for (const level of ["lod0", "lod1", "lod2"]) {
      const path = `/bundle/channels/Balls/r0_c0/${level}.glb`;
      stand.host.overrides.set(path, { status: 404, body: "gone" });
    }
    await stand.open(`&mode=off${query}`);
    await stand.viewer.settled();
    expect(await covered()).toEqual([]);
    if (query === "") await openAllSections(stand.viewer);
    for (const key of ["t", "i", "\\"]) await page().keyboard.press(key);
    await page().locator(".slices figure").first().waitFor();
    expect(await page().locator(".notices p").count()).toBeGreaterThan(0);
    expect(await covered()).toEqual([]);
    await page().keyboard.press("h");
    expect(await covered()).toEqual([]);
    for (const [key, dialog] of [
      ["?", "dialog[data-help]"],
      [":", "dialog[data-card]"],
    ]) {
      await page().keyboard.press(key);
      await page().locator(dialog).waitFor();
      expect(await covered()).toEqual([]);
      await page().keyboard.press("Escape");
      await page().locator(dialog).waitFor({ state: "hidden" });
    }
  });

  it.each([
    ["lying", LYING],
    ["upright", UPRIGHT],
  ])("marks the tapped place exactly for any covered edges: %s", async (_, size) => {
    await page().setViewportSize(size);
    await coverEdges();
    await stand.open("&mode=off");
    await stand.viewer.settled();
    const stage = await page().locator(".stage").boundingBox();
    if (stage === null) throw new Error("no stage");
    const { min, max } = stand.manifest.tiles[0].bounds_um;
    const front = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]] as const;
    const { bounds_um } = stand.manifest.specimen;
    const at = project(front, bounds_um, stage.width, stage.height);
    await stand.viewer.clickOnce(stage.x + at.x, stage.y + at.y);
    await page().locator("[data-tap-card]").waitFor();
    const mark = await page().locator(".tap-mark").boundingBox();
    if (mark === null) throw new Error("no mark");
    expect(Math.abs(mark.x + mark.width / 2 - stage.x - at.x)).toBeLessThan(1.5);
    expect(Math.abs(mark.y + mark.height / 2 - stage.y - at.y)).toBeLessThan(1.5);
    const card = await page().locator("[data-tap-card]").boundingBox();
    expect(card?.x).toBeGreaterThanOrEqual(INSETS.left);
  });

  it.each([
    ["upright", UPRIGHT, ""],
    ["upright, the panel hidden", UPRIGHT, "h"],
    ["lying", LYING, ""],
    ["lying, the panel hidden", LYING, "h"],
  ])("has a button back from a tile within reach of a thumb: %s", async (_, size, key) => {
    await page().setViewportSize(size);
    await stand.open("&mode=off");
    const back = page().locator('[data-overlay="back"]');
    expect(await back.isVisible()).toBe(false);
    for (const each of ["t", "i", ...(key === "" ? [] : [key])]) await page().keyboard.press(each);
    const box = await back.boundingBox();
    expect(box?.y).toBeGreaterThan((2 / 3) * size.height);
    await back.tap();
    expect((await stand.viewer.snapshot()).state.isolated).toBeNull();
    expect(await back.isVisible()).toBe(false);
  });
});
