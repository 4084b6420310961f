/** Input on the canvas: clicks, dragging with the mouse, dragging with a finger. */
import { beforeEach, expect, it } from "vitest";
import { project } from "../support/browser/camera";
import { difference, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";

/**
 * Share of the image's pixels that change when the specimen moves; it fills a good part of them.
 */
const TURNED = 0.02;

describeInChromium("input on the canvas", () => {
  const viewport = { width: 504, height: 240 };
  const stand = prepareStand({ viewport, hasTouch: true });

  beforeEach(async () => {
    await stand.open();
    await stand.viewer.settled();
  });

  const tileNow = async () => (await stand.viewer.snapshot()).state.selected;

  async function stageBox() {
    const box = await stand.viewer.page.locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    return { ...box, middle: [box.x + box.width / 2, box.y + box.height / 2] as const };
  }

  it("chooses exactly the tile under a click", async () => {
    expect(await tileNow()).toBeNull();
    const box = await stageBox();
    const { tiles } = stand.manifest;
    for (const tile of [tiles[0], tiles[tiles.length - 1]]) {
      const { min, max } = tile.bounds_um;
      const front = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]] as const;
      const { x, y } = project(front, stand.manifest.specimen.bounds_um, box.width, box.height);
      await stand.viewer.page.mouse.click(box.x + x, box.y + y);
      expect(await tileNow()).toBe(tile.id);
    }
  });

  it("chooses no tile where the tile is clipped away", async () => {
    const box = await stageBox();
    const [{ id, bounds_um }] = stand.manifest.tiles;
    const { min, max } = bounds_um;
    const front = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]] as const;
    const { specimen } = stand.manifest;
    const { x, y } = project(front, specimen.bounds_um, box.width, box.height);
    const { page } = stand.viewer;
    await page.keyboard.press("b");
    await page.mouse.click(box.x + x, box.y + y); // a corner where the clip box leaves nothing
    expect(await tileNow()).toBeNull();
    await page.keyboard.press("b");
    await page.mouse.click(box.x + x, box.y + y);
    expect(await tileNow()).toBe(id);
  });

  it("moves the view with keys, and back", async () => {
    const { page } = stand.viewer;
    const before = await takePicture(page);
    for (const key of ["Shift+ArrowRight", "Shift+ArrowUp"]) await page.keyboard.press(key);
    await stand.viewer.still();
    expect(difference(before, await takePicture(page))).toBeGreaterThan(TURNED);
    for (const key of ["Shift+ArrowLeft", "Shift+ArrowDown"]) await page.keyboard.press(key);
    await stand.viewer.still();
    expect(difference(before, await takePicture(page))).toBeLessThan(TURNED / 10);
  });

  it("isolates the tile from the card beside a click, and shows all tiles again", async () => {
    const box = await stageBox();
    const [{ id, bounds_um }] = stand.manifest.tiles;
    const { min, max } = bounds_um;
    const front = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]] as const;
    const { x, y } = project(front, stand.manifest.specimen.bounds_um, box.width, box.height);
    const click = () => stand.viewer.clickOnce(box.x + x, box.y + y);
    const whole = await takePicture(stand.viewer.page);
    await click();
    await click(); // the second click opens the same card
    expect((await stand.viewer.snapshot()).state.isolated).toBeNull();
    await stand.viewer.page.locator('[data-control="tap-isolate"]').click();
    await stand.viewer.settled();
    expect((await stand.viewer.snapshot()).state.isolated).toBe(id);
    await stand.viewer.page.keyboard.press("Escape"); // closes the card
    expect(difference(whole, await takePicture(stand.viewer.page))).toBeGreaterThan(TURNED);
    await stand.viewer.page.keyboard.press("Escape");
    await stand.viewer.settled();
    const { isolated, selected } = (await stand.viewer.snapshot()).state;
    expect([isolated, selected]).toEqual([null, id]);
    await stand.viewer.page.keyboard.press("Escape");
    await stand.viewer.settled();
    expect(await tileNow()).toBeNull();
    expect(difference(whole, await takePicture(stand.viewer.page))).toBeLessThan(TURNED / 10);
  });

  it("turns the specimen by dragging, without choosing anything", async () => {
    const before = await takePicture(stand.viewer.page);
    const start = await tileNow();
    const { middle, width } = await stageBox();
    await stand.viewer.drag([middle[0] - width / 3, middle[1]], [middle[0], middle[1]]);
    expect(difference(before, await takePicture(stand.viewer.page))).toBeGreaterThan(TURNED);
    expect(await tileNow()).toBe(start);
    await stand.viewer.page.locator('[data-action="reset"]').click();
    await stand.viewer.still();
    expect(difference(before, await takePicture(stand.viewer.page))).toBeLessThan(TURNED / 10);
  });

  it("turns the specimen with one finger", async () => {
    const before = await takePicture(stand.viewer.page);
    const { middle, height } = await stageBox();
    const devtools = await stand.viewer.page.context().newCDPSession(stand.viewer.page);
    const touch = (type: "touchStart" | "touchMove" | "touchEnd", dx: number) =>
      devtools.send("Input.dispatchTouchEvent", {
        type,
        touchPoints: type === "touchEnd" ? [] : [{ x: middle[0] + dx, y: middle[1] }],
      });
    await touch("touchStart", 0);
    for (const share of [0.1, 0.2, 0.3]) await touch("touchMove", share * height);
    await touch("touchEnd", 0);
    await stand.viewer.still();
    expect(difference(before, await takePicture(stand.viewer.page))).toBeGreaterThan(TURNED);
  });

  // also without any volume
  it.each(sweep(["off", "all"] as const, (mode) => mode === "off"))(
    "measures, and shows the channels' values (%s) in the panel too",
    async (mode) => {
      await stand.viewer.chooseMode(mode);
      const box = await stageBox();
      const { specimen, tiles } = stand.manifest;
      await stand.viewer.page.keyboard.press("p");
      for (const { bounds_um } of tiles.slice(0, 2)) {
        const { min, max } = bounds_um;
        const front = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]] as const;
        const { x, y } = project(front, specimen.bounds_um, box.width, box.height);
        await stand.viewer.page.mouse.click(box.x + x, box.y + y);
      }
      const points = async () => (await stand.viewer.snapshot()).state.measured.length;
      await expect.poll(points).toBe(2);
      const values = async () => (await stand.viewer.snapshot()).measuredValues;
      const least = async () => {
        const [one = [], two = []] = await values();
        return Math.min(one.length, two.length);
      };
      await expect.poll(least).toBeGreaterThan(0);
      await stand.viewer.unfold("measure");
      const [first, second] = (await values()).map((lines) => lines.join(" · "));
      expect([first, second].join()).toMatch(/\d.*,.*\d/);
      const fact = (i: number) => stand.viewer.page.locator(`[data-control="values-${i}"]`);
      await expect.poll(() => fact(0).textContent()).toBe(`First point${first}`);
      await expect.poll(() => fact(1).textContent()).toBe(`Second point${second}`);
    },
  );

  it("chooses nothing with two fingers, even if they do not move", async () => {
    const { middle } = await stageBox();
    const devtools = await stand.viewer.page.context().newCDPSession(stand.viewer.page);
    const [x, y] = middle;
    const [one, two] = [
      { x: x - 20, y, id: 1 },
      { x: x + 20, y, id: 2 },
    ];
    const touch = (type: "touchStart" | "touchEnd", touchPoints: (typeof one)[]) =>
      devtools.send("Input.dispatchTouchEvent", { type, touchPoints });
    await touch("touchStart", [one]);
    await touch("touchStart", [one, two]);
    await touch("touchEnd", [one]);
    await touch("touchEnd", []);
    await stand.viewer.still();
    expect(await tileNow()).toBeNull();
    await touch("touchStart", [one]); // one finger chooses
    await touch("touchEnd", []);
    await stand.viewer.still();
    expect(await tileNow()).not.toBeNull();
  });

  it("has targets of at least 40 pixels for fingers", async () => {
    await stand.viewer.drawVolume(stand.manifest.channels[0].id, true);
    const small = await stand.viewer.page.evaluate(() => {
      const isShown = (e: Element) => e.getClientRects().length > 0;
      const selector = ".panel button, .panel select, .panel label, .panel input";
      const covered = "label input"; // the label around it is the target
      return [...document.querySelectorAll(selector)]
        .filter((e) => isShown(e) && !e.matches(covered))
        .map((e) => ({ text: e.outerHTML.slice(0, 80), box: e.getBoundingClientRect() }))
        .filter(({ box }) => Math.min(box.width, box.height) < 40)
        .map(({ text, box }) => `${text}: ${box.width} x ${box.height}`);
    });
    expect(small).toEqual([]);
  });
});
