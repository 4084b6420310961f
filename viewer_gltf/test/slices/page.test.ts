/** The three slices in the page: images, crosshair, keys, values, and quads in the specimen. */
import { beforeAll, expect, it } from "vitest";
import { project } from "../support/browser/camera";
import { difference, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";

const SHOTS = process.env.STEREOCELL_SHOTS;

describeInChromium("slices", () => {
  const stand = prepareStand({
    viewport: { width: 720, height: 420 },
    sharesPage: true,
  });
  const page = () => stand.viewer.page;
  const state = async () => (await stand.viewer.snapshot()).state;
  const plane = (i: number) => page().locator(`[data-slice="${i}"]`);
  /** Share of a slice's pixels that aren't dark. */
  const lit = (i: number) =>
    plane(i)
      .locator("canvas")
      .evaluate((canvas: HTMLCanvasElement) => {
        const context = canvas.getContext("2d");
        const { data } = context?.getImageData(0, 0, canvas.width, canvas.height) ?? { data: [] };
        let count = 0;
        for (let k = 0; k < data.length; k += 4)
          if (data[k] + data[k + 1] + data[k + 2] > 90) count++;
        return count / (data.length / 4);
      });

  beforeAll(async () => {
    await stand.open("&mode=off#v=1&slices=on&slice-x=0.2");
    await stand.viewer.settled();
  });

  it("are shown all three, with axes at the edges and the values at their intersection", async () => {
    for (const i of [0, 1, 2]) expect(await lit(i), `${i}`).toBeGreaterThan(0.01);
    const ends = await plane(0).locator(".end").allTextContents();
    expect(ends).toEqual(["−x", "+x", "+y", "−y"]);
    expect(await page().locator(".slices .values").first().textContent()).toMatch(/ \d+/);
    if (SHOTS) await page().screenshot({ path: `${SHOTS}/slices.png` });
  });

  it("move the crosshair by a click and by keys, with one step to undo for each", async () => {
    const box = await plane(0).boundingBox();
    if (box === null) throw new Error("no picture");
    const before = await state();
    await page().mouse.click(box.x + 0.3 * box.width, box.y + 0.25 * box.height);
    const clicked = await state();
    expect(clicked.sliceX).toBeCloseTo(0.3, 1);
    expect(clicked.sliceY).toBeGreaterThan(0.6); // y runs up
    expect(clicked.sliceZ).toBe(before.sliceZ);
    await plane(0).press("ArrowRight");
    expect((await state()).sliceX).toBeCloseTo(clicked.sliceX + 0.01, 3);
    await plane(0).press("PageUp");
    expect((await state()).sliceZ).toBeGreaterThan(before.sliceZ);
    await plane(0).press("Shift+ArrowLeft");
    expect((await state()).sliceTurnZ_deg).toBeCloseTo(5, 6);
    for (let i = 0; i < 9 && (await state()).sliceX !== before.sliceX; i++) {
      await page().keyboard.press("Control+z");
    }
    const back = await state();
    expect([back.sliceX, back.sliceY, back.sliceZ, back.sliceTurnZ_deg]).toEqual([
      before.sliceX,
      before.sliceY,
      before.sliceZ,
      0,
    ]);
  });

  it("rotate by a drag with Shift, and widen the window by a drag with the right button", async () => {
    const box = await plane(0).boundingBox();
    if (box === null) throw new Error("no picture");
    const at = (x: number, y: number) => [box.x + x * box.width, box.y + y * box.height] as const;
    await page().keyboard.down("Shift");
    await page().mouse.move(...at(0.9, 0.5));
    await page().mouse.down();
    await page().mouse.move(...at(0.5, 0.1), { steps: 4 });
    await page().mouse.up();
    await page().keyboard.up("Shift");
    expect(Math.abs((await state()).sliceTurnZ_deg)).toBeGreaterThan(45);
    await page().keyboard.press("~");
    expect((await state()).sliceTurnZ_deg).toBe(0);
    await page().mouse.move(...at(0.5, 0.5));
    await page().mouse.down({ button: "right" });
    await page().mouse.move(...at(0.2, 0.5), { steps: 3 });
    await page().mouse.up({ button: "right" });
    const [low, high] = (await state()).channels[0].window;
    expect(high - low).toBeCloseTo(0.7, 1);
  });

  it("show all values without overlapping letters, even in little space", async () => {
    await page().setViewportSize({ width: 560, height: 420 }); // 100 pixels for each slice
    await plane(1).evaluate((each) => each.style.setProperty("--ratio", "8")); // thin ones
    const boxes = await page()
      .locator("figure")
      .evaluateAll((figures) =>
        figures.map((figure) => {
          const boxOf = (each: Element) => {
            const { left, right, top, bottom } = each.getBoundingClientRect();
            return { left, right, top, bottom };
          };
          const all = (what: string) => [...figure.querySelectorAll(what)].map(boxOf);
          return { figure: boxOf(figure), letters: all(".end"), values: all(".values span") };
        }),
      );
    await page().setViewportSize({ width: 720, height: 420 });
    type Box = (typeof boxes)[number]["figure"];
    const areApart = (a: Box, b: Box) =>
      a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
    expect(boxes.length).toBe(3);
    for (const { figure, letters, values } of boxes) {
      expect(values.length).toBeGreaterThan(2);
      for (const each of [...letters, ...values]) {
        expect(each.left).toBeGreaterThanOrEqual(figure.left);
        expect(each.right).toBeLessThanOrEqual(figure.right);
        expect(each.top).toBeGreaterThanOrEqual(figure.top);
        expect(each.bottom).toBeLessThanOrEqual(figure.bottom);
      }
      const [left, right, top, bottom] = letters;
      for (const [a, b] of [
        [top, bottom],
        [left, right],
        ...values.flatMap((each) => [[each, bottom] as const, [each, left] as const]),
      ] as const) {
        expect(areApart(a, b), JSON.stringify([a, b])).toBe(true);
      }
    }
  });

  it("show as quads in the specimen", async () => {
    await page().keyboard.press("\\");
    await stand.viewer.still();
    const without = await takePicture(page());
    await page().keyboard.press("|");
    await stand.viewer.settled();
    await stand.viewer.still();
    expect(difference(await takePicture(page()), without)).toBeGreaterThan(0.1);
    if (SHOTS) await page().screenshot({ path: `${SHOTS}/planes.png` });
  });
});

describeInChromium("slices that are shown as quads in the specimen", () => {
  const viewport = { width: 480, height: 272 };
  const stand = prepareStand({ viewport });

  for (const mode of sweep(["off", "all"], (each) => each === "all")) {
    it(`are not hidden by parts between them and the eye, volumes ${mode}`, async () => {
      const { min, max } = stand.manifest.specimen.bounds_um;
      const at = async (cut: string) => {
        const slices = "&planes=on&slice-x=0.1&slice-y=0.1&slice-z=0.3";
        await stand.open(`&mode=${mode}&switch=9&quality=high#v=1&depth=0${slices}${cut}`);
        await stand.viewer.settled();
        return takePicture(stand.viewer.page);
      };
      const bare = await at(`&box=${[...max.map((v) => v - 1), ...max].join(",")}`); // nothing of the specimen is left
      const whole = await at("");
      let [alike, lit] = [0, 0];
      for (let x = 0.2; x < 0.9; x += 0.02) {
        for (let y = 0.2; y < 0.9; y += 0.02) {
          const point = ([x, y, 0.3] as const).map((v, i) => min[i] + v * (max[i] - min[i]));
          const { x: px, y: py } = project(
            point as unknown as readonly [number, number, number],
            stand.manifest.specimen.bounds_um,
            whole.width,
            whole.height,
          );
          const [a, b] = [bare.at(px, py), whole.at(px, py)];
          if (a.every((v, i) => Math.abs(v - b[i]) < 4)) alike++;
          if (Math.max(...b) > 40) lit++;
        }
      }
      expect(lit).toBeGreaterThan(50);
      // Parts that extend beyond the corner cover some pixels.
      expect(alike / 36 ** 2).toBeGreaterThan(0.9);
    });
  }
});

describeInChromium("planes whose voxels are on their way", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 320 } });

  it("hide no part of the specimen until they have loaded", async () => {
    const { page } = stand.viewer;
    let release = (): void => undefined;
    const gate = new Promise<void>((resolve) => {
      release = resolve;
    });
    await page.route("**/volumes/**", async (route) => {
      await gate;
      await route.continue();
    });
    await stand.open("&mode=off");
    await stand.viewer.settled();
    const without = await takePicture(page);
    await page.keyboard.press("|");
    await expect.poll(() => page.locator(".slices").count()).toBe(1); // the code has loaded
    await page.waitForTimeout(1000);
    expect(difference(await takePicture(page), without)).toBeLessThan(0.001);
    release();
    await expect
      .poll(async () => difference(await takePicture(page), without), { timeout: 30_000 })
      .toBeGreaterThan(0.1);
  });
});

describeInChromium("slices whose code does not come", () => {
  const stand = prepareStand({ viewport: { width: 480, height: 320 } });

  it("are requested again after a notice", async () => {
    const { page } = stand.viewer;
    const CODE = "**/assets/slices-*.js";
    await page.route(CODE, (route) => route.abort());
    await stand.open("&mode=off");
    await stand.viewer.settled();
    await page.keyboard.press("|");
    const notice = () => page.locator("[data-notices]").textContent();
    await expect.poll(notice).toContain("that shows slices could not be loaded");
    expect(await page.locator(".slices").count()).toBe(0);
    await page.unroute(CODE);
    await page.keyboard.press("R");
    await stand.viewer.settled();
    expect(await page.locator(".slices").count()).toBe(1);
    expect(await notice()).toBe("");
  });
});

describeInChromium("slices of a CT", () => {
  const stand = prepareStand({ viewport: { width: 640, height: 420 } });

  it("have the patient's sides, and values and windows in Hounsfield units", async () => {
    const { manifest, host, viewer } = stand;
    const [first, ...others] = manifest.channels;
    const sides = { left: [1, 0, 0], posterior: [0, 0, -1], superior: [0, 1, 0] };
    const scan = {
      ...manifest,
      specimen: { ...manifest.specimen, modality: "CT", sides },
      channels: [{ ...first, window: [-1024, 2000] }, ...others],
    };
    host.overrides.set("/bundle/manifest.json", { status: 200, body: JSON.stringify(scan) });
    await stand.open("&mode=off#v=1&slices=on");
    await viewer.settled();
    const { page } = viewer;
    const texts = (part: string) => page.locator(`.slices ${part}`).allTextContents();
    expect(await texts("figcaption")).toEqual(["axial", "coronal", "sagittal"]);
    // Slices have the radiological orientation: seen from the feet, and from the front.
    expect(await texts(".end")).toEqual([..."RLAPRLSIAPSI"]);
    for (const text of await texts(".values")) expect(text).toMatch(/-?\d+ HU/);
    await page.keyboard.press("e");
    const announced = () => page.locator("[data-announcement]").textContent();
    expect(await announced()).toBe("F body: window -1024 – 1953 HU");
    await viewer.openCard("F_x20_body");
    expect(await page.locator('[data-channel="F_x20_body"]').textContent()).toContain(
      "-1024 – 1953 HU",
    );
  });
});
