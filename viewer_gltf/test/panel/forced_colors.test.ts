/**
 * High contrast: with the few colours of the system, states, colours, sliders and the focus remain
 * visible.
 */
import type { Locator } from "playwright-core";
import { beforeAll, expect, it } from "vitest";
import { openAllSections } from "../support/browser/open_sections";
import { decodePng } from "../support/browser/png";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

describeInChromium("high contrast", () => {
  const stand = prepareStand({
    ...{ viewport: { width: 900, height: 600 }, pixelRatio: 1 },
    ...{ isBlind: true, sharesPage: true },
  });
  const page = () => stand.viewer.page;

  beforeAll(async () => {
    await stand.open("&mode=off");
    await page().emulateMedia({ forcedColors: "active", colorScheme: "dark" });
    await openAllSections(stand.viewer);
  });

  async function pictureOf(found: Locator) {
    await found.scrollIntoViewIfNeeded();
    await page().mouse.move(1, 1);
    return decodePng(await found.screenshot());
  }

  /** Pixels of an element: red, green, blue, opacity. */
  const pixelsOf = async (found: Locator) => [...(await pictureOf(found)).rgba];

  /** Share of the pixels that differ clearly. */
  function difference(a: readonly number[], b: readonly number[]): number {
    const count = Math.min(a.length, b.length) / 4;
    const isOther = (i: number) =>
      [0, 1, 2].some((c) => Math.abs(a[4 * i + c] - b[4 * i + c]) > 60);
    return Array.from({ length: count }, (_, i) => i).filter(isOther).length / count;
  }

  /** Share of light pixels; the colour scheme is dark. */
  const lightShare = (pixels: readonly number[]) =>
    (4 * pixels.filter((value, i) => i % 4 === 1 && value > 128).length) / pixels.length;

  it("shows the drawing on the button for the full screen", async () => {
    const share = lightShare(await pixelsOf(page().locator('[data-overlay="full-screen"]')));
    const empty = lightShare(await pixelsOf(page().locator(".fold")));
    expect(empty).toBeGreaterThan(0.01); // a chevron
    expect(share).toBeGreaterThan(0.08); // more than the ring around it
  });

  it("shows whether a switch is on", async () => {
    const control = page().locator('[data-control="clip-box"]');
    const off = await pixelsOf(control);
    await control.check();
    await page().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    const on = await pixelsOf(control);
    await control.uncheck();
    expect(difference(off, on)).toBeGreaterThan(0.3);
    expect(lightShare(off)).toBeGreaterThan(0.2); // the edge and the dot of the switch
    expect(lightShare(off)).toBeLessThan(0.6);
  });

  it("shows which of several options is chosen", async () => {
    const span = (value: string) => page().locator(`[data-picture-size="${value}"] + span`);
    const before = await pixelsOf(span("1"));
    await page().locator('[data-picture-size="1"]').check({ force: true });
    await page().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    expect(difference(before, await pixelsOf(span("1")))).toBeGreaterThan(0.5);
    const tile = page().locator('[data-tile-choice="r0_c1"]');
    const plain = await pixelsOf(tile);
    await tile.click();
    await page().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    expect(difference(plain, await pixelsOf(tile))).toBeGreaterThan(0.5);
  });

  it("keeps the colours of palettes and of channels, and marks the chosen one", async () => {
    const swatch = page().locator('.swatch[aria-pressed="false"]').nth(1);
    const hex = (await swatch.getAttribute("data-color")) ?? "";
    const { width, height, rgba } = await pictureOf(swatch);
    const middle = 4 * (Math.floor(height / 2) * width + Math.floor(width / 2));
    const wanted = [1, 3, 5].map((at) => Number.parseInt(hex.slice(at, at + 2), 16));
    expect([...rgba.slice(middle, middle + 3)]).toEqual(wanted);
    await swatch.click();
    const outline = await page()
      .locator('.swatch[aria-pressed="true"]')
      .first()
      .evaluate((each) => getComputedStyle(each).outlineStyle);
    expect(outline).toBe("solid");
  });

  it("shows the track, the thumbs and the filled part of a slider", async () => {
    const track = page().locator(".ends").first();
    const whole = await pixelsOf(track);
    await page().locator('[data-part="window-low"]').first().fill("200");
    const part = await pixelsOf(track);
    expect(difference(whole, part)).toBeGreaterThan(0.1);
  });

  it("draws a ring around the focused element", async () => {
    const button = page().locator('[data-action="share"]');
    await button.scrollIntoViewIfNeeded();
    const box = await button.boundingBox();
    if (box === null) throw new Error("no button");
    const clip = { x: box.x - 6, y: box.y - 6, width: box.width + 12, height: box.height + 12 };
    const shot = async () => [...decodePng(await page().screenshot({ clip })).rgba];
    await page().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    const before = await shot();
    await page().keyboard.press("Tab"); // switches the page to keyboard mode
    await button.focus();
    expect(difference(before, await shot())).toBeGreaterThan(0.04);
  });
});
