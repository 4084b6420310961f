/** Undo and redo in the page, by key and by the panel, of settings and of the camera. */
import { beforeAll, expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;

describeInChromium("undo and redo", () => {
  const stand = prepareStand({
    viewport: { width: 640, height: 480 },
    isBlind: SHOTS === undefined,
  });
  const page = () => stand.viewer.page;
  const state = async () => (await stand.viewer.snapshot()).state;
  const axes = () => page().locator(".orientation-mark").getAttribute("aria-label");

  beforeAll(async () => {
    await stand.open("&mode=disc");
    await stand.viewer.settled();
  });

  it("undo a drag, a press and a turn, one step each, and redo them", async () => {
    const control = (id: string) => page().locator(`[data-control="${id}"]`);
    expect(await control("undo").isDisabled()).toBe(true); // settings of the address are not steps
    const before = await state();
    const slider = control("disc-radius");
    await slider.scrollIntoViewIfNeeded();
    const box = await slider.boundingBox();
    if (box === null) throw new Error("no slider");
    const y = box.y + box.height / 2;
    await page().mouse.move(box.x + box.width / 2, y);
    await page().mouse.down();
    for (const share of [0.3, 0.6, 0.9]) await page().mouse.move(box.x + share * box.width, y);
    await page().mouse.up();
    const dragged = await state();
    expect(dragged.discRadius_deg).toBeGreaterThan(before.discRadius_deg);
    await stand.viewer.chooseMode("all");
    await page()
      .locator(".stage")
      .focus()
      .catch(() => undefined);
    await page().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    const seen = await axes();
    for (let i = 0; i < 6; i++) await page().keyboard.press("ArrowRight"); // by 90 degrees
    await stand.viewer.still();
    const turned = await axes();
    expect(turned).not.toBe(seen);
    await page().keyboard.press("Control+z");
    await stand.viewer.still();
    expect(await axes()).toBe(seen);
    expect(await page().locator(".announcement").textContent()).toContain("Undone: viewpoint");
    await page().keyboard.press("Control+z");
    expect((await state()).mode).toBe("disc");
    await control("undo").click();
    expect((await state()).discRadius_deg).toBe(before.discRadius_deg);
    expect(await control("undo").isDisabled()).toBe(true);
    if (SHOTS) await page().screenshot({ path: `${SHOTS}/undo.png` });
    await page().keyboard.press("Control+Shift+z");
    expect((await state()).discRadius_deg).toBe(dragged.discRadius_deg);
    await page().keyboard.press("Control+y");
    await control("redo").click();
    await stand.viewer.still();
    expect([(await state()).mode, await axes()]).toEqual(["all", turned]);
    expect(await control("redo").isDisabled()).toBe(true);
  });
});
