/**
 * The panel in headless Chromium: every control by pointer and by keyboard, labels, contrast,
 * narrow windows. STEREOCELL_SHOTS names a folder for screenshots.
 */
import { join } from "node:path";
import { beforeAll, beforeEach, describe, expect, it } from "vitest";
import { tileName } from "../../src/state/tile_name";
import type { ViewerState } from "../../src/state/viewer_state";
import { addHeadset } from "../support/browser/chromium";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand, type Stand } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;
const SCREEN = { viewport: { width: 640, height: 480 }, isBlind: SHOTS === undefined };
const [FIRST, SECOND] = ["F_x20_body", "Balls"];

/** The panel of a page that is open or will be opened. */
function panelOf(stand: Stand) {
  const page = () => stand.viewer.page;
  const control = (id: string) => page().locator(`[data-control="${id}"]`);
  const state = async (): Promise<ViewerState> => (await stand.viewer.snapshot()).state;
  const first = async () => (await state()).channels[0];
  const focused = () =>
    page().evaluate(() => (document.activeElement as HTMLElement | null)?.dataset.control ?? null);

  async function openAll(): Promise<void> {
    for (const section of ["measure", "cut", "quality", "share"]) {
      await stand.viewer.unfold(section);
    }
    await stand.viewer.openCard(FIRST);
  }

  return { page, control, state, first, focused, openAll };
}

describeInChromium("the panel", () => {
  const stand = prepareStand(SCREEN);
  const { page, control, state, first, focused, openAll } = panelOf(stand);

  beforeEach(async () => {
    await stand.open();
    await stand.viewer.settled();
  });

  it("changes the state by pointer, control by control", async () => {
    await openAll();
    const { viewer } = stand;
    await viewer.show(SECOND, false);
    expect((await state()).channels[1].shown).toBe(false);
    await viewer.drawVolume(FIRST, false);
    expect((await first()).volume).toBe(false);
    await viewer.drawVolume(FIRST, true);
    await viewer.chooseTransferFunction(FIRST, "soft");
    expect((await first()).transferFunction).toBe("soft");
    await viewer.recolor(FIRST, "#ff00ff");
    expect((await first()).color).toEqual([1, 0, 1]);
    await page().locator(`[data-channel="${FIRST}"] [data-color="#56b4e9"]`).click();
    expect((await first()).color[2]).toBeCloseTo(0.815, 2);
    await viewer.slide(`${FIRST}/opacity`, 0.4);
    expect((await first()).opacity).toBeCloseTo(0.4, 2);
    await viewer.slide(`${FIRST}/window-low`, 0.2);
    await viewer.slide(`${FIRST}/window-high`, 0.6);
    expect((await first()).window[0]).toBeCloseTo(0.2, 2);
    expect((await first()).window[1]).toBeCloseTo(0.6, 2);
    await viewer.slide("disc-radius", 0);
    await viewer.slide("switch-distance", 1);
    expect((await state()).discRadius_deg).toBe(2);
    expect((await state()).switchDistance_m).toBe(10);
    for (const mode of ["tile", "all", "off", "disc"] as const) {
      await viewer.chooseMode(mode);
      expect((await state()).mode).toBe(mode);
    }
    await viewer.chooseTile("r0_c1");
    expect((await state()).selected).toBe("r0_c1");
    await control("isolate").click();
    expect((await state()).isolated).toBe("r0_c1");
    await control("back").click();
    await control("back").click();
    expect([(await state()).isolated, (await state()).selected]).toEqual([null, null]);
    for (const [id, key] of [
      ["clip-box", "box"],
      ["clip-plane", "plane"],
    ] as const) {
      await control(id).check();
      expect((await state()).clip[key]).not.toBeNull();
      await control(id).uncheck();
      expect((await state()).clip[key]).toBeNull();
    }
    await page().locator('[data-tool="measure"]').check({ force: true });
    expect((await state()).tool).toBe("measure");
    await page().locator('[data-quality="low"]').check({ force: true });
    expect((await state()).quality).toBe("low");
    await control("dwell").uncheck();
    expect((await state()).isDwellOn).toBe(false);
  });

  it("is operated by the keyboard alone, which keeps its focus", async () => {
    await openAll();
    /** Moves the focus to a control by Tab, from the start of the panel. */
    async function tabTo(id: string): Promise<void> {
      await page().locator(".fold").focus();
      for (let i = 0; i < 80 && (await focused()) !== id; i++) await page().keyboard.press("Tab");
      expect(await focused()).toBe(id);
    }
    await tabTo(`${FIRST}/shown`);
    await page().keyboard.press("Space"); // its card moves to the end of the list
    expect((await first()).shown).toBe(false);
    expect(await focused()).toBe(`${FIRST}/shown`);
    await page().keyboard.press("Space");
    expect((await first()).shown).toBe(true);
    expect(await focused()).toBe(`${FIRST}/shown`);
    await stand.viewer.openCard(FIRST);

    await tabTo(`${FIRST}/opacity`);
    for (let i = 0; i < 5; i++) await page().keyboard.press("ArrowLeft");
    expect((await first()).opacity).toBeCloseTo(0.95, 5);
    await tabTo(`${FIRST}/window-low`);
    await page().keyboard.press("ArrowRight");
    expect((await first()).window[0]).toBeCloseTo(1 / 255, 5);
    await tabTo(`${FIRST}/palette`);
    await page().keyboard.press("ArrowRight");
    await page().keyboard.press("Enter");
    expect(await page().evaluate(() => document.activeElement?.ariaPressed)).toBe("true");
    await tabTo("mode");
    await page().keyboard.press("ArrowRight");
    expect((await state()).mode).toBe("tile");
    await tabTo("tile-map");
    await page().keyboard.press("ArrowRight");
    await page().keyboard.press("Enter");
    expect((await state()).selected).toBe("r0_c1");
    await tabTo("back");
    await page().keyboard.press("Enter");
    expect((await state()).selected).toBeNull();
    expect(await focused()).toBe("back"); // the button has no effect now, but keeps the focus
  });

  it("has keys for everything else", async () => {
    const press = (key: string) => page().keyboard.press(key);
    await press("o");
    expect((await first()).opacity).toBeCloseTo(0.95, 5);
    expect(await page().locator("[data-announcement]").textContent()).toBe("F body: opacity 95 %");
    await press("m");
    expect((await state()).mode).toBe("tile");
    await press("b");
    const box = async () => (await state()).clip.box;
    const before = await box();
    await press("B"); // the last face of the box
    await press(".");
    expect((await box())?.min).toEqual(before?.min);
    expect((await box())?.max[2]).toBeGreaterThan(before?.max[2] ?? Number.NaN);
    expect(await page().locator("[data-announcement]").textContent()).toMatch(/^Box: z to .+ µm$/);
    await press("h");
    expect(await page().locator(".panel .body").isVisible()).toBe(false);
    await press("h");
    await stand.viewer.openCard(FIRST);
    await control(`${FIRST}/transfer-function`).focus();
    await press("o");
    expect((await first()).opacity).toBeCloseTo(0.9, 5);
  });

  it("switches single-character keys off, also for the next visit, and on again", async () => {
    const { channels } = await state();
    await stand.viewer.unfold("share");
    await control("letters").uncheck();
    const press = (key: string) => page().keyboard.press(key);
    for (const key of ["1", "x", "m", "B"]) await press(key);
    expect((await state()).channels).toEqual(channels);
    await stand.open();
    await press("1");
    expect((await state()).channels).toEqual(channels);
    await press("?"); // the list of keys says where the switch is
    await page().getByRole("dialog").waitFor(); // its code is loaded on demand
    await press("Escape");
    await control("letters").check();
    await page()
      .locator(".stage canvas")
      .click({ position: { x: 3, y: 3 } });
    await press("1");
    expect((await state()).channels[0].shown).toBe(!channels[0].shown);
  });

  it("keeps the keys working after any click", async () => {
    const press = (key: string) => page().keyboard.press(key);
    const axes = () => page().locator(".orientation-mark").getAttribute("aria-label");
    await control("top").click();
    await stand.viewer.still();
    const above = await axes();
    for (let i = 0; i < 6; i++) await press("ArrowRight"); // a quarter turn
    await stand.viewer.still();
    expect(await axes()).not.toBe(above);
    await press("Enter"); // the focused button takes this key
    await stand.viewer.still();
    expect(await axes()).toBe(above);

    const [tile] = await page().locator('[data-tile-choice="r0_c1"]').all();
    await tile.click();
    await tile.click();
    expect((await state()).isolated).toBe("r0_c1");
    await press("Escape");
    expect((await state()).isolated).toBeNull();

    await control("disc-radius").click();
    const { discRadius_deg } = await state();
    await press("ArrowRight"); // the focused slider takes this key
    expect((await state()).discRadius_deg).toBeCloseTo(discRadius_deg + 0.5, 5);
    const from = await axes();
    await press("z");
    await stand.viewer.still();
    expect(await axes()).not.toBe(from);
  });

  it("cuts an isolated tile at its own middle, and reports an empty cut", async () => {
    await stand.viewer.unfold("cut");
    const announced = () => page().locator("[data-announcement]").textContent();
    const { tiles } = stand.manifest;
    const [one, other] = [tiles[0], tiles[tiles.length - 1]];
    const alone = (tile: string) => page().locator(`[data-tile-choice="${tile}"]`).click();
    await alone(one.id);
    await alone(one.id);
    await control("clip-box").check();
    const { box } = (await state()).clip;
    for (const i of [0, 1, 2]) {
      const edge = one.bounds_um.max[i] - one.bounds_um.min[i];
      expect(box?.min[i]).toBeCloseTo(one.bounds_um.min[i] + edge / 4, 5);
      expect(box?.max[i]).toBeCloseTo(one.bounds_um.max[i] - edge / 4, 5);
    }
    await alone(other.id);
    expect((await state()).isolated).toBe(other.id);
    expect(await announced()).toBe(
      `Only ${tileName(other.id, [])} is shown, and the cut removes all of it.`,
    );
  });

  it("lists all keys in a dialog that keeps the focus until Escape", async () => {
    await page().keyboard.press("?");
    const dialog = page().locator("dialog[data-help]");
    await dialog.waitFor();
    for (const words of ["Copy a link", "Turn left", "Cut by a box"]) {
      expect(await dialog.textContent()).toContain(words);
    }
    for (let i = 0; i < 6; i++) {
      await page().keyboard.press("Tab");
      const isOut = await page().evaluate(() => {
        const { activeElement } = document;
        return activeElement !== document.body && activeElement?.closest("dialog") === null;
      });
      expect(isOut).toBe(false);
    }
    await page().keyboard.press("o"); // no key has an effect behind the dialog
    expect((await first()).opacity).toBe(1);
    if (SHOTS !== undefined) await page().screenshot({ path: join(SHOTS, "keys.png") });
    const find = dialog.locator('[data-control="find-key"]');
    const labels = () => dialog.locator("dd:visible").allTextContents();
    const all = (await labels()).length;
    await find.fill("cut box");
    expect(await labels()).toEqual(["Cut by a box: on or off"]);
    await find.fill("no such key");
    expect(await labels()).toEqual([]);
    expect(await dialog.textContent()).toContain("No key matches this text.");
    await page().keyboard.press("Escape");
    expect(await dialog.isVisible()).toBe(false);
    for (const isOpen of [true, false]) {
      await page().keyboard.press("?");
      expect(await dialog.isVisible()).toBe(isOpen);
      if (isOpen) expect((await labels()).length).toBe(all); // the search text is cleared
    }
  });
});

describeInChromium("the panel of a page with other conditions", () => {
  const stand = prepareStand(SCREEN);
  const { page, control, state, first, focused } = panelOf(stand);

  it("leaves a field with Escape, also that of the link", async () => {
    await page().addInitScript(() => {
      Object.defineProperty(navigator, "clipboard", { value: undefined });
    });
    await stand.open();
    const press = (key: string) => page().keyboard.press(key);
    await press("l");
    await expect.poll(focused).toBe("link");
    await press("o"); // the field takes this key
    expect((await first()).opacity).toBe(1);
    await press("Escape");
    expect(await focused()).toBeNull();
    await press("o");
    expect((await first()).opacity).toBeCloseTo(0.95, 5);
  });

  it("makes the same announcement in stereo", async () => {
    await addHeadset(page());
    await stand.open("&mode=off");
    await stand.viewer.enterStereo();
    // isolates the next tile
    for (const key of ["t", "i", "b", "t"]) await page().keyboard.press(key);
    const { isolated } = await state();
    const { stereoNotices } = await stand.viewer.snapshot();
    expect(stereoNotices.at(-1)).toBe(
      `Only ${tileName(isolated ?? "", [])} is shown, and the cut removes all of it.`,
    );
    expect((await state()).notices).toEqual([]);
  });

  it("finds one of seventy channels, and names the one that is hidden for a fifth", async () => {
    const { manifest, host } = stand;
    const [, , block] = manifest.channels;
    const more = Array.from({ length: 67 }, (_, i) => ({
      ...block,
      id: `marker_${i}`,
      name: `Marker ${i}`,
    }));
    const body = JSON.stringify({ ...manifest, channels: [...manifest.channels, ...more] });
    host.overrides.set("/bundle/manifest.json", { status: 200, body });
    await stand.open("&mode=off");
    expect(await page().locator("[data-channel]:not([data-channel^=lamp])").count()).toBeLessThan(
      12,
    );
    await page().keyboard.press("h");
    await page().keyboard.press("/");
    expect(await focused()).toBe("find-channel");
    await control("find-channel").fill("marker 42");
    await page().keyboard.press("Tab"); // the swatch
    await page().keyboard.press("Tab");
    await page().keyboard.press("Space");
    const shown = (await state()).channels.filter((channel) => channel.shown);
    expect(shown.map(({ id }) => id)).toEqual(["Balls", "Block", "marker_0", "marker_42"]);
    expect(await focused()).toBe("marker_42/shown");
    expect(await page().locator("[data-announcement]").textContent()).toBe(
      "At most 4 channels can be shown at once: F body was hidden to show Marker 42.",
    );
    // the announcement is not a notice, and disappears by itself
    expect((await state()).notices).toEqual([]);
    await expect.poll(() => page().locator("[data-announcement]").textContent()).toBe("");
    if (SHOTS !== undefined) await page().screenshot({ path: join(SHOTS, "channels-70.png") });
  });
});

describeInChromium("the layout of the panel", () => {
  const stand = prepareStand({ ...SCREEN, sharesPage: true });
  const { page, control, openAll } = panelOf(stand);

  beforeAll(async () => {
    await stand.open();
    await stand.viewer.settled();
  });

  it("names every control for a screen reader", async () => {
    await openAll();
    const nameless = await page().evaluate(() =>
      [...document.querySelectorAll<HTMLElement>("button, input, select, [role=group]")]
        .filter((each) => {
          const label = each instanceof HTMLInputElement ? each.labels?.[0]?.textContent : "";
          return ![each.ariaLabel, each.textContent, label].some((name) => name?.trim());
        })
        .map((each) => each.outerHTML.slice(0, 100)),
    );
    expect(nameless).toEqual([]);
    expect(await control(`${FIRST}/opacity`).getAttribute("aria-valuetext")).toBe("100 %");
    expect(await control(`${FIRST}/shown`).getAttribute("aria-label")).toBe("Show F body");
    const [tile] = await page().locator('[data-tile-choice="r0_c0"]').all();
    await tile.click();
    expect(await tile.getAttribute("aria-label")).toMatch(/^Tile in row 1, column 1, selected/);
    expect(await tile.getAttribute("aria-pressed")).toBe("true");
    expect(await page().locator("[data-notices]").getAttribute("role")).toBe("status");
  });

  it("has text with a contrast of at least 4.5 : 1", async () => {
    await openAll();
    await stand.viewer.chooseTile("r0_c0");
    await control("isolate").click();
    const low = await page().evaluate(lowContrasts);
    expect(low).toEqual([]);
  });

  describe.each([
    [320, 640],
    [1280, 720],
  ])("at %i x %i", (width, height) => {
    it("fits, and leaves enough space for the view", async () => {
      await page().setViewportSize({ width, height });
      await stand.viewer.openCard(FIRST);
      await stand.viewer.settled();
      await page().waitForTimeout(400); // the figures are updated slightly later
      const sizes = await page().evaluate(() => {
        const box = (selector: string) =>
          document.querySelector(selector)?.getBoundingClientRect() ?? new DOMRect();
        const right = (each: Element) => each.getBoundingClientRect().right;
        const padding_px = 16;
        const isOut = (each: HTMLElement) => {
          const items = each.closest(".items");
          return items !== null && right(each) > right(items) - padding_px + 0.5;
        };
        return {
          page: document.documentElement.scrollWidth,
          stage: [box(".stage").width, box(".stage").height],
          out: [...document.querySelectorAll<HTMLElement>(".items > *, .items button")]
            .filter(isOut)
            .map((each) => each.outerHTML.slice(0, 80)),
        };
      });
      expect(sizes.page).toBeLessThanOrEqual(width);
      expect(sizes.out).toEqual([]);
      expect(sizes.stage[0] * sizes.stage[1]).toBeGreaterThan(0.5 * width * height);
      if (SHOTS !== undefined) {
        await page().screenshot({ path: join(SHOTS, `panel-${width}.png`) });
        await openAll();
        await page()
          .locator(".panel .body")
          .evaluate((body) => body.scrollTo(0, 1e5));
        await page().screenshot({ path: join(SHOTS, `panel-${width}-end.png`) });
      }
    });
  });
});

/** Runs in the page: texts with too low a contrast (WCAG 2.2, 1.4.3), except disabled ones. */
function lowContrasts(): string[] {
  type Rgba = [number, number, number, number];
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  if (canvas === null) throw new Error("no 2D canvas");
  const read = (color: string): Rgba => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = color;
    canvas.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = (top: Rgba, under: Rgba): Rgba => {
    const mix = (i: number) => top[i] * top[3] + under[i] * (1 - top[3]);
    return [mix(0), mix(1), mix(2), 1];
  };
  const ground = (element: Element | null): Rgba => {
    if (element === null) return [0, 0, 0, 1];
    const own = read(getComputedStyle(element).backgroundColor);
    return own[3] === 1 ? own : over(own, ground(element.parentElement));
  };
  const luminance = (color: Rgba) => {
    const linear = (v: number) =>
      v <= 10.31475 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4;
    return 0.2126 * linear(color[0]) + 0.7152 * linear(color[1]) + 0.0722 * linear(color[2]);
  };
  const low: string[] = [];
  for (const element of document.querySelectorAll<HTMLElement>(".panel *")) {
    const hasText = [...element.childNodes].some(
      (node) => node.nodeType === Node.TEXT_NODE && node.textContent?.trim() !== "",
    );
    if (!hasText || element.getClientRects().length === 0) continue;
    if (element.closest("[aria-disabled=true], :disabled, option") !== null) continue;
    const back = ground(element);
    const text = over(read(getComputedStyle(element).color), back);
    const [a, b] = [luminance(text), luminance(back)].sort((x, y) => y - x);
    const ratio = (a + 0.05) / (b + 0.05);
    if (ratio < 4.5) low.push(`${ratio.toFixed(2)}: ${element.outerHTML.slice(0, 80)}`);
  }
  return low;
}
