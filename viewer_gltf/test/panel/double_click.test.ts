/** Each double click on the flat panel counts once. STEREOCELL_SHOTS names a folder for a screenshot. */
import { join } from "node:path";
import { beforeAll, expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;
const SECTIONS = ["light", "measure", "cut", "slices", "quality", "share"];

describeInChromium("a double click on the panel", () => {
  const viewport = { width: SHOTS ? 1600 : 640, height: SHOTS ? 720 : 480 };
  const stand = prepareStand({ viewport, isBlind: SHOTS === undefined, sharesPage: true });
  const page = () => stand.viewer.page;
  const state = async () => (await stand.viewer.snapshot()).state;
  const places = () =>
    page()
      .locator('[data-section="channels"] .channel')
      .evaluateAll((all) => all.map((each) => [each.ariaLabel, (each as HTMLElement).offsetTop]));

  beforeAll(async () => {
    await stand.open("&mode=traced");
    for (const section of SECTIONS) await stand.viewer.unfold(section);
    await stand.viewer.openCard("F_x20_body");
  });

  it("switches each switch once, and moves no row of the channels", async () => {
    const switches = page().locator('.panel [role="switch"]:visible:not([aria-disabled="true"])');
    const ids = await switches.evaluateAll((all) =>
      all.map((each) => (each as HTMLElement).dataset.control ?? ""),
    );
    expect(ids.length).toBeGreaterThan(12);
    for (const id of ids) {
      const control = page().locator(`[data-control="${id}"]`);
      const [was, rows] = [await control.isChecked(), await places()];
      // the checkbox is invisible under the text of its label, which users click
      await control.dblclick({ force: true });
      expect(await control.isChecked(), id).toBe(!was);
      if (!id.endsWith("/plane")) expect(await places(), id).toEqual(rows);
      if (SHOTS && id === "F_x20_body/shown") {
        await page().screenshot({ path: join(SHOTS, "flat_hidden.png") });
      }
      await control.click({ force: true });
      expect(await control.isChecked(), id).toBe(was);
    }
  });

  it("opens or closes a section or a card once", async () => {
    const ids = await page()
      .locator(".panel [data-opener]:visible")
      .evaluateAll((all) => all.map((each) => (each as HTMLElement).dataset.opener ?? ""));
    expect(ids.length).toBeGreaterThan(12);
    for (const id of ids) {
      const opener = page().locator(`[data-opener="${id}"]`);
      const was = await opener.getAttribute("aria-expanded");
      await opener.dblclick();
      expect(await opener.getAttribute("aria-expanded"), id).not.toBe(was);
      await opener.click();
      expect(await opener.getAttribute("aria-expanded"), id).toBe(was);
    }
  });

  it("selects a tile and does not isolate it", async () => {
    await page().locator('[data-tile-choice="r0_c1"]').dblclick();
    const { selected, isolated } = await state();
    expect([selected, isolated]).toEqual(["r0_c1", null]);
  });

  it("undoes twice, because each click on Undo is a step", async () => {
    const quality = page().locator('[data-control="quality"][value="high"]');
    const isChosen = () => quality.isChecked();
    await quality.setChecked(true, { force: true });
    await page().locator('[data-control="clip-box"]').click({ force: true });
    await page().locator('[data-control="undo"]').dblclick();
    expect([(await state()).clip.box, await isChosen()]).toEqual([null, false]);
  });
});
