/**
 * The card beside a tapped place: by mouse, finger and keyboard. STEREOCELL_SHOTS names a folder
 * for screenshots.
 */
import { join } from "node:path";
import { beforeEach, expect, it } from "vitest";
import { project } from "../support/browser/camera";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;
/** A wait that is longer than the one for a second click, ms. */
const DOUBLE_CLICK_MS = 600;

describeInChromium("the card beside a tapped place", () => {
  const stand = prepareStand({
    viewport: { width: 1280, height: 720 },
    hasTouch: true,
    isBlind: SHOTS === undefined,
  });
  const page = () => stand.viewer.page;
  const card = () => page().locator("[data-tap-card]");
  const control = (id: string) => page().locator(`[data-control="tap-${id}"]`);
  const state = async () => (await stand.viewer.snapshot()).state;

  /** Middle of a tile's front face on the page, px. */
  async function placeOf(index: number) {
    const box = await page().locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    const { min, max } = stand.manifest.tiles[index].bounds_um;
    const front = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]] as const;
    const { x, y } = project(front, stand.manifest.specimen.bounds_um, box.width, box.height);
    return { x: box.x + x, y: box.y + y, stage: box };
  }

  async function click(index: number): Promise<void> {
    const { x, y } = await placeOf(index);
    await stand.viewer.clickOnce(x, y);
    await card().waitFor({ state: "visible" });
  }

  beforeEach(async () => {
    await stand.open();
    await stand.viewer.settled();
  });

  it("names the structure, and hides, recolours, isolates and undoes", async () => {
    await click(0);
    const [tile] = stand.manifest.tiles;
    expect((await state()).selected).toBe(tile.id);
    const title = (await card().locator("h2").textContent()) ?? "";
    const channel = (await state()).channels.find(({ name }) => name === title);
    if (channel === undefined) throw new Error(`no channel is called ${title}`);
    const now = async () => (await state()).channels.find(({ id }) => id === channel.id);
    expect(await card().textContent()).toContain("Tile in row 1, column 1");
    const cutOff = await card()
      .locator("button")
      .evaluateAll((all) =>
        all.filter((one) => one.scrollWidth > one.clientWidth).map((one) => one.textContent),
      );
    expect(cutOff).toEqual([]);

    await card().locator("[data-color]").nth(3).click();
    expect((await now())?.color).not.toEqual(channel.color);
    await control("undo").click();
    expect((await now())?.color).toEqual(channel.color);
    await control("hide").click();
    expect((await now())?.shown).toBe(false);
    expect(await control("hide").textContent()).toBe(`Show ${title}`);
    await control("hide").click();
    expect((await now())?.shown).toBe(true);
    await control("isolate").click();
    expect((await state()).isolated).toBe(tile.id);
    await control("undo").click();
    expect((await state()).isolated).toBeNull();
    await control("close").click();
    expect(await card().isVisible()).toBe(false);
  });

  it("opens neither after a double click nor after a drag", async () => {
    const { x, y } = await placeOf(0);
    await page().mouse.dblclick(x, y);
    await page().waitForTimeout(DOUBLE_CLICK_MS);
    await stand.viewer.still();
    expect(await card().isVisible()).toBe(false);
    await stand.viewer.drag([x, y], [x + 60, y]);
    await page().waitForTimeout(DOUBLE_CLICK_MS);
    expect(await card().isVisible()).toBe(false);
  });

  it("moves to the next place, and closes after a tap beside the specimen", async () => {
    await click(0);
    const last = stand.manifest.tiles.length - 1;
    await click(last);
    await expect.poll(() => card().textContent()).toContain(`row 1, column ${last + 1}`);
    const { stage } = await placeOf(0);
    await stand.viewer.clickOnce(stage.x + 4, stage.y + 4);
    await expect.poll(() => card().isVisible()).toBe(false);
  });

  it("takes the focus if a key opened it, and returns it at Escape", async () => {
    await page().keyboard.press("Enter");
    await card().waitFor({ state: "visible" });
    const { selected } = await state();
    expect(selected).not.toBeNull();
    const isInside = () =>
      page().evaluate(() => document.activeElement?.closest("[data-tap-card]") !== null);
    await expect.poll(isInside).toBe(true);
    await page().keyboard.press("Enter"); // the first button takes this key: Show only this tile
    expect((await state()).isolated).toBe(selected);
    await page().keyboard.press("Escape");
    expect(await card().isVisible()).toBe(false);
    expect((await state()).isolated).toBe(selected); // the first Escape only closes the card
    await page().keyboard.press("Escape");
    expect((await state()).isolated).toBeNull();
  });

  it("follows its place as the view turns, and closes once the place is outside the view", async () => {
    await click(0);
    const mark = () => page().locator(".tap-mark").boundingBox();
    const before = await mark();
    await page().keyboard.press("ArrowRight");
    await stand.viewer.still();
    expect((await mark())?.x).not.toBeCloseTo(before?.x ?? Number.NaN, 0);
    expect(await card().isVisible()).toBe(true);
    for (let i = 0; i < 8; i++) await page().keyboard.press("+");
    await stand.viewer.still();
    for (let i = 0; i < 8; i++) await page().keyboard.press("Shift+ArrowRight");
    await stand.viewer.still();
    expect(await card().isVisible()).toBe(false);
  });

  it.each([
    [390, 844],
    [844, 390],
    [900, 600],
  ])("stays in a window of %i x %i, beside the tapped place", async (width, height) => {
    await page().setViewportSize({ width, height });
    await stand.viewer.still();
    const { stage } = await placeOf(0);
    const middle = { x: stage.x + stage.width / 2, y: stage.y + stage.height / 2 };
    for (const { x, y } of [await placeOf(0), middle, await placeOf(1)]) {
      await page().touchscreen.tap(x, y);
      await card().waitFor({ state: "visible" });
      const box = await card().boundingBox();
      if (box === null) throw new Error("no card");
      expect(box.x).toBeGreaterThanOrEqual(stage.x);
      expect(box.y).toBeGreaterThanOrEqual(stage.y);
      expect(box.x + box.width).toBeLessThanOrEqual(stage.x + stage.width);
      expect(box.y + box.height).toBeLessThanOrEqual(stage.y + stage.height);
      const isOver = x > box.x && x < box.x + box.width && y > box.y && y < box.y + box.height;
      expect(isOver, `${JSON.stringify(box)} over ${x}, ${y}`).toBe(false);
      if (SHOTS) {
        await page().screenshot({ path: join(SHOTS, `tap_${width}_${Math.round(x)}.png`) });
      }
      await page().keyboard.press("Escape"); // the card may lie over the next place
      await page().waitForTimeout(DOUBLE_CLICK_MS);
    }
  });
});
