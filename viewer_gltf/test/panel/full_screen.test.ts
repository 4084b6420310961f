/**
 * The full screen of the flat page: by its button and its key, and no button if the browser does
 * not support it.
 */
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

describeInChromium("the full screen", () => {
  const stand = prepareStand({ viewport: { width: 640, height: 480 }, isBlind: true });
  const page = () => stand.viewer.page;
  const button = () => page().locator('[data-overlay="full-screen"]');
  const isFull = () => page().evaluate(() => document.fullscreenElement !== null);

  it("shows the panel and the view, and ends again, by button and by key", async () => {
    await stand.open();
    await button().click();
    await expect.poll(isFull).toBe(true);
    expect(await page().locator(".panel").isVisible()).toBe(true);
    await expect.poll(() => button().getAttribute("aria-label")).toBe("Leave the full screen");
    await page()
      .locator(".stage canvas")
      .click({ position: { x: 3, y: 3 } });
    await page().keyboard.press("Shift+Enter");
    await expect.poll(isFull).toBe(false);
    await expect.poll(() => button().getAttribute("aria-label")).toBe("Full screen");
    await page().keyboard.press("Shift+Enter");
    await expect.poll(isFull).toBe(true);
    await button().click();
    await expect.poll(isFull).toBe(false);
  });

  it("has no button if the browser does not support it, which its key reports", async () => {
    await page().addInitScript(() => {
      Object.defineProperty(document, "fullscreenEnabled", { value: false });
    });
    await stand.open();
    expect(await button().isVisible()).toBe(false);
    await page().keyboard.press("Shift+Enter");
    const announced = () => page().locator("[data-announcement]").textContent();
    await expect.poll(announced).toMatch(/full screen/);
  });
});
