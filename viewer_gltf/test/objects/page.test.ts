/** Objects of a label map in the page: colours, filters, picking, cuts, search, links and files. */
import { expect, it } from "vitest";
import { project } from "../support/browser/camera";
import { restBetweenFrames } from "../support/browser/chromium";
import { hasColor, isBackground, type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import {
  BEAM,
  BEAM_MIDDLE,
  CHANNEL,
  COLORS,
  COUNT,
  centerOf,
  labelOf,
  prepareObjects,
  rowAt,
} from "../support/object_bundle";
import { hasPython } from "../support/python";

const FRONT = rowAt(0, 4, 1, 1);
const BEHIND = rowAt(0, 4, 1, 0);

describeInChromium("the objects of a label map", () => {
  if (!hasPython) {
    it.skip("needs Python");
    return;
  }
  const stand = prepareStand({
    bundle: prepareObjects(),
    viewport: { width: 900, height: 500 },
  });
  const control = (part: string) =>
    stand.viewer.page.locator(`[data-control="${CHANNEL}/objects-${part}"]`);
  /** Opens the page and the panel's section of objects. */
  const open = async (query = "") => {
    await stand.open(query);
    await stand.viewer.unfold("objects");
  };
  const view = async () => (await stand.viewer.snapshot()).state.objects[CHANNEL];
  const shown = () => control("count").innerText();

  /** Returns the pixel at which a place shows. */
  const spot = (picture: Picture, point: readonly [number, number, number]) =>
    project(point, stand.manifest.specimen.bounds_um, picture.width, picture.height);
  const at = (picture: Picture, point: readonly [number, number, number]) => {
    const { x, y } = spot(picture, point);
    return picture.at(x, y);
  };
  const tap = async (point: readonly [number, number, number]) => {
    const box = await stand.viewer.page.locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    const { x, y } = project(point, stand.manifest.specimen.bounds_um, box.width, box.height);
    await stand.viewer.clickOnce(box.x + x, box.y + y);
    await stand.viewer.settled();
  };
  const choose = async (part: string, value: string) => {
    await control(part).selectOption(value);
    await stand.viewer.settled();
  };

  it("open in the colours of the table's own column, with one draw call per tile and a panel that fits long names", async () => {
    await open();
    await stand.viewer.settled();
    const picture = await takePicture(stand.viewer.page);
    for (const row of [
      rowAt(0, 2, 0, 1),
      rowAt(0, 3, 1, 1),
      rowAt(1, 1, 2, 1),
      rowAt(1, 2, 1, 1),
    ]) {
      expect(hasColor(COLORS[row % 3])(at(picture, centerOf(row))), `row ${row}`).toBe(true);
    }
    expect(hasColor(COLORS[BEAM % 3])(at(picture, [57, -42.5, 16]))).toBe(true); // in both tiles
    expect(hasColor(COLORS[BEAM % 3])(at(picture, [63, -42.5, 16]))).toBe(true);
    expect(await shown()).toContain(`${COUNT} of ${COUNT} objects`);
    expect((await stand.viewer.snapshot()).drawCalls).toBeLessThan(20);
    // The hint does not mention volumes, because there are none.
    const { page } = stand.viewer;
    const hint = page.locator('[data-overlay="hint"]');
    expect(await hint.textContent()).toBe("drag to turn, wheel to zoom");
    const sections = await page
      .locator("[data-section]")
      .evaluateAll((found) => found.map((each) => (each as HTMLElement).dataset.section));
    expect(sections).toContain("objects");
    for (const id of ["volumes", "light", "slices"]) expect(sections).not.toContain(id);

    // A column with a long name does not widen the panel.
    const [wide, inside] = await control("color-by").evaluate((found) => {
      const select = found as HTMLSelectElement;
      select.options[1].text = "Intensity_MeanIntensityEdge_OrigNuclei_of_a_long_name";
      select.options[1].selected = true;
      const items = select.closest(".items") as HTMLElement;
      return [select.getBoundingClientRect().right, items.getBoundingClientRect().right];
    });
    expect(wide).toBeLessThan(inside);
  });

  it("are recoloured with one upload of a byte per object", async () => {
    await open();
    await stand.viewer.settled();
    await stand.viewer.page.evaluate(() => {
      const uploads: number[] = [];
      Object.assign(window, { uploads });
      const { prototype } = WebGL2RenderingContext;
      for (const name of ["texImage2D", "texSubImage2D"] as const) {
        const upload = prototype[name] as (...given: unknown[]) => void;
        Object.assign(prototype, {
          [name](this: WebGL2RenderingContext, ...given: unknown[]) {
            for (const each of given) if (ArrayBuffer.isView(each)) uploads.push(each.byteLength);
            upload.apply(this, given);
          },
        });
      }
    });
    const asked = () => stand.host.requests.map(({ path }) => path);
    expect(asked().filter((path) => path.includes("CD8"))).toEqual([]);
    await choose("color-by", "CD8");
    expect(asked().filter((path) => path.includes("CD8"))).toHaveLength(1);
    const uploads = () =>
      stand.viewer.page.evaluate(() =>
        (window as never as { uploads: number[] }).uploads.splice(0),
      );
    expect((await uploads()).sort()).toEqual([1024, 256]); // another kind of column also needs another palette
    await choose("color-by", "x_um");
    await choose("color-by", "CD8");
    for (const bytes of await uploads()) expect([256, 1024]).toContain(bytes);
    // The swatch beside the channel's name shows the palette instead of one colour.
    const swatch = stand.viewer.page.locator(`[data-control="${CHANNEL}/color"]`);
    const shown = () => swatch.evaluate((input) => input.style.getPropertyValue("--shows"));
    await expect.poll(shown).toMatch(/^linear-gradient\(90deg,#440154 .*#fde725/);
    const picture = await takePicture(stand.viewer.page);
    const brightness = (row: number) => at(picture, centerOf(row))[1];
    expect(brightness(rowAt(1, 4, 1, 1))).toBeGreaterThan(brightness(rowAt(0, 0, 1, 1)) + 40);
  });

  it("are filtered by category and by range, counted, and shrink from their interfaces by the gap", async () => {
    await open();
    await stand.viewer.settled();
    const row = rowAt(0, 3, 1, 1); // row 23 has category 2
    await control("column-cell_type").click({ position: { x: 20, y: 60 } });
    await stand.viewer.settled();
    expect((await view()).without.cell_type).toEqual([2]);
    expect(await shown()).toContain(`${COUNT - 20} of ${COUNT}`);
    expect(hasColor(COLORS[2])(at(await takePicture(stand.viewer.page), centerOf(row)))).toBe(
      false,
    );
    await choose("filter-by", "x_um");
    await control("range-x_um-high").fill("127"); // the middle of the range; only the first tile passes
    await stand.viewer.settled();
    const { ranges } = await view();
    expect(ranges.x_um[1]).toBe(128);
    const picture = await takePicture(stand.viewer.page);
    expect(isBackground(at(picture, centerOf(rowAt(1, 1, 1, 1))))).toBe(true);
    expect(isBackground(at(picture, centerOf(rowAt(0, 1, 1, 1))))).toBe(false);
    await control("all").click();
    await stand.viewer.settled();
    expect(await shown()).toContain(`${COUNT} of ${COUNT}`);

    // All objects shrink from their interfaces by the gap.
    const drawn = async () =>
      (await takePicture(stand.viewer.page)).count((pixel) => !isBackground(pixel));
    const before = await drawn();
    await control("gap").fill("20");
    await stand.viewer.settled();
    expect((await view()).gap_um).toBeCloseTo(2, 1); // 20 of the 40 steps, which are half a ball's width together
    expect(await drawn()).toBeLessThan(0.75 * before);
    const aside = rowAt(0, 0, 1, 1); // there is no object to its left
    const [x, y, z] = centerOf(aside);
    await tap([x - 3.5, y, z]); // the radius of 4 um has shrunk to 3 um
    expect((await view()).picked).toBeNull();
    await tap([x - 2.5, y, z]);
    expect((await view()).picked).toBe(aside);
  });

  it("open their card with all columns on a tap, and hidden objects let the tap pass", async () => {
    await open();
    await stand.viewer.settled();
    await tap(centerOf(FRONT));
    expect((await view()).picked).toBe(FRONT);
    await stand.viewer.settled();
    await expect.poll(() => control("card").innerText()).toContain(String(labelOf(FRONT)));
    await expect.poll(() => control("card-volume_um3").innerText()).toContain("268 µm³");
    await expect.poll(() => control("card-cell_type").innerText()).toContain("T cell");
    await expect.poll(() => control("card-CD8").innerText()).toContain("286 counts");
    expect(await control("card-next").innerText()).toContain("1");
    await control("hide").click();
    await tap(centerOf(FRONT));
    expect((await view()).picked).toBe(BEHIND);
    await tap(centerOf(FRONT)); // a second tap closes the card
    expect((await view()).picked).toBeNull();
    await tap([63, -42.5, 16]);
    expect((await view()).picked).toBe(BEAM);
    await control("only").click();
    await stand.viewer.settled();
    const picture = await takePicture(stand.viewer.page);
    expect(isBackground(at(picture, BEAM_MIDDLE))).toBe(false);
    expect(isBackground(at(picture, centerOf(BEHIND)))).toBe(true);
  });

  it("open their card within the view, with its commands", async () => {
    const { page } = stand.viewer;
    await open();
    await stand.viewer.settled();
    const isInView = (part: string) =>
      control(part).evaluate((found) => {
        const body = found.closest(".body")?.getBoundingClientRect() as DOMRect;
        const { top, bottom } = found.getBoundingClientRect();
        return top >= body.top && bottom <= body.bottom;
      });
    expect(await isInView("card")).toBe(false);
    await tap(centerOf(FRONT));
    for (const part of ["card", "fly", "only", "hide"]) {
      await expect.poll(() => isInView(part), { message: part }).toBe(true);
    }
    await tap(centerOf(FRONT)); // closes the card
    await page.locator(".panel .body").evaluate((body) => body.scrollTo(0, 0));
    await page.emulateMedia({ reducedMotion: "reduce" });
    await tap(centerOf(FRONT));
    expect(await isInView("card"), "at once").toBe(true);
    await page.emulateMedia({ reducedMotion: null });
    expect(await page.evaluate(() => scrollY)).toBe(0);
  });

  it("open their card if the gaze rests, which is not a step to undo", async () => {
    const { page } = stand.viewer;
    await restBetweenFrames(page);
    await open();
    await stand.viewer.settled();
    await page.locator('[data-action="split"]').dispatchEvent("click");
    await page.waitForFunction(() => window.stereocell?.snapshot().isStereo);
    // The specimen moves until a ball is straight ahead, by 10 um per step.
    for (const key of ["Shift+ArrowUp", "Shift+ArrowUp", "Shift+ArrowLeft", "Shift+ArrowLeft"]) {
      await page.keyboard.press(key);
      await stand.viewer.drawn(2);
    }
    const ahead = rowAt(0, 3, 0, 1);
    await page.waitForTimeout(2500); // an object that moved under a resting gaze opens no card
    expect((await view())?.picked).toBeUndefined();
    for (const alpha of [0, 20, 0]) {
      await page.evaluate((degrees) => {
        const turn = { alpha: degrees, beta: 90, gamma: 0 };
        dispatchEvent(new DeviceOrientationEvent("deviceorientation", turn));
      }, alpha);
      await stand.viewer.drawn(2);
      await page.waitForTimeout(700); // the first movement brings the object ahead
      await stand.viewer.drawn(2);
    }
    await expect.poll(async () => (await view())?.picked).toBe(ahead);
    expect((await stand.viewer.snapshot()).stereoNotices).toContain(`Object ${labelOf(ahead)}`);
    await page.waitForTimeout(2500); // the gaze still rests there, so the card stays
    expect((await view()).picked).toBe(ahead);
    await page.keyboard.press("Control+z");
    expect((await view()).picked).toBe(ahead);
  });

  it("are found by number, and the camera flies to them", async () => {
    await open();
    await stand.viewer.settled();
    // For an object behind another one, the camera moves to a place from which it is visible.
    await control("search").fill(String(labelOf(BEHIND)));
    await control(`found-${BEHIND}`).click();
    await stand.viewer.settled();
    await control("close").click();
    await stand.viewer.settled();
    const later = await takePicture(stand.viewer.page);
    const own = later.at(later.width / 2, later.height / 2);
    expect(hasColor(COLORS[BEHIND % 3])(own)).toBe(true);
    const { look: aside } = await stand.viewer.snapshot();
    expect(aside.position[2], "from behind").toBeLessThan(aside.target[2]);
    const { look } = await stand.viewer.snapshot();
    const wanted = rowAt(1, 4, 2, 1);
    await control("search").fill(String(labelOf(wanted)));
    await control(`found-${wanted}`).click();
    await stand.viewer.settled();
    const after = await stand.viewer.snapshot();
    expect(after.state.objects[CHANNEL].picked).toBe(wanted);
    expect(after.look.target[0]).toBeGreaterThan(look.target[0] + 0.1);
    const picture = await takePicture(stand.viewer.page);
    const middle = picture.at(picture.width / 2, picture.height / 2);
    expect(isBackground(middle)).toBe(false);
  });

  it("have caps in their own colour if they are cut open", async () => {
    await open("#v=1&cut=0,0,1,18"); // through the centres of the objects in front
    await stand.viewer.settled();
    const picture = await takePicture(stand.viewer.page);
    for (const row of [rowAt(0, 2, 1, 1), rowAt(0, 3, 1, 1), FRONT, rowAt(1, 2, 1, 1)]) {
      const [x, y, z] = centerOf(row);
      const cap = [-2, 0, 2].map((by) => at(picture, [x + by, y, z]));
      for (const pixel of cap) expect(hasColor(COLORS[row % 3])(pixel), `row ${row}`).toBe(true);
      const apart = Math.max(...cap[0].map((v, i) => Math.abs(v - cap[2][i])));
      expect(apart, "flat").toBeLessThan(12);
    }
  });

  it("are selected by a lasso in the plot and saved as a file, and the link contains all settings", async () => {
    await open();
    await stand.viewer.settled();
    const { page } = stand.viewer;
    await choose("scatter-0", "x_um");
    await choose("scatter-1", "row");
    const plot = control("scatter");
    await plot.scrollIntoViewIfNeeded();
    const box = await plot.boundingBox();
    if (box === null) throw new Error("no plot");
    const move = (x: number, y: number) =>
      page.mouse.move(box.x + x * box.width, box.y + y * box.height, { steps: 3 });
    await move(0.02, 0.02);
    await page.mouse.down();
    for (const [x, y] of [
      [0.02, 0.98],
      [0.45, 0.98],
      [0.45, 0.02],
      [0.03, 0.02],
    ])
      await move(x, y);
    await page.mouse.up();
    await stand.viewer.settled();
    const { selected } = await view();
    expect(selected).toContain(12);
    expect(selected.every((row) => centerOf(row)[0] < 0.45 * 108 + 6)).toBe(true);
    expect(selected.length).toBeGreaterThan(15);
    const coming = page.waitForEvent("download");
    await expect
      .poll(async () => {
        await page.locator('[data-control="save-objects"]').click();
        return page.locator("[data-announcement]").innerText();
      })
      .toContain("Saved");
    const parts: Buffer[] = [];
    for await (const part of await (await coming).createReadStream()) parts.push(part);
    const text = Buffer.concat(parts).toString("utf8");
    const lines = text.trim().split("\r\n");
    expect(lines[0]).toBe("label,name,volume_um3 (um3),x_um (um),CD8 (counts),row,cell_type");
    expect(lines).toHaveLength(selected.length + 1);
    await choose("color-by", "CD8");
    const { hash } = new URL(await stand.viewer.writeLink());
    expect(hash).toContain("objects=");
    const linked = await view();
    await open(hash);
    await stand.viewer.settled();
    await expect.poll(async () => (await view()).selected).toEqual(selected);
    expect(await view()).toEqual({ ...linked, lasso: [], aim: null });
  });
});

describeInChromium("a stain that is painted on objects", () => {
  if (!hasPython) {
    it.skip("needs Python");
    return;
  }
  const stand = prepareStand({
    bundle: prepareObjects("--painted"),
    viewport: { width: 900, height: 500 },
  });

  it("lies over their colour and can be removed, and a column's colours remain available", async () => {
    await stand.open();
    await stand.viewer.unfold("objects");
    await stand.viewer.settled();
    const row = rowAt(1, 2, 1, 1);
    const [x, y, z] = centerOf(row);
    const spots = async () => {
      const picture = await takePicture(stand.viewer.page);
      return [2, -2].map((up) => {
        const at = project(
          [x, y + up, z],
          stand.manifest.specimen.bounds_um,
          picture.width,
          picture.height,
        );
        return picture.at(at.x, at.y);
      });
    };
    const own = hasColor(COLORS[row % 3]);
    const [above, below] = await spots();
    expect(own(below)).toBe(true);
    expect(own(above)).toBe(false);
    expect(Math.max(...above) - Math.min(...above)).toBeLessThan(12); // DNA has no colour of its own, so it is white
    await stand.viewer.page.locator(`[data-control="${CHANNEL}/objects-stain"]`).click();
    await stand.viewer.settled();
    const bare = await spots();
    expect(bare.map(own)).toEqual([true, true]);
    expect((await stand.viewer.snapshot()).state.objects[CHANNEL].isStained).toBe(false);
  });
});
