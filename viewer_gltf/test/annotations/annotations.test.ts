/** Marks on the specimen, in a page that shows only them: lengths, angles, drags and names. */
import { readFile } from "node:fs/promises";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, beforeEach, expect, it } from "vitest";
import { LABEL_HEIGHT, LABEL_PX, STEREO_TEXT } from "../../src/marks/style";
import type { Vec3 } from "../../src/math/vec3";
import { bundled } from "../support/browser/bundled";
import type { Browser } from "../support/browser/chromium";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";

const WIDTH = 720;
const HEIGHT = 480;
/** Folder for screenshots, if set. */
const PICTURES = process.env.MARKS_PICTURES;

describeInChromium("marks", () => {
  let browser: Browser;
  let page: Page;
  let script: string;

  beforeAll(async () => {
    browser = await openBrowser({ viewport: { width: WIDTH, height: HEIGHT } });
    const built = await bundled(new URL("../support/annotations/harness.ts", import.meta.url));
    script = built.replaceAll("{}.url", "location.href"); // a classic script has no import.meta
    page = await browser.context.newPage();
    // The page has an address, since a worker's address is relative to it.
    await page.route("http://marks.test/", (route) =>
      route.fulfill({
        contentType: "text/html",
        body: '<main class="view"><div class="stage"></div></main>',
      }),
    );
  });

  afterAll(() => browser?.close());

  beforeEach(async () => {
    await page.goto("about:blank");
    await page.mouse.move(-1, -1);
    await page.goto("http://marks.test/");
    for (const sheet of [
      "panel/html/colors.css",
      "panel/html/page.css",
      "annotations/annotations.css",
    ]) {
      const content = await readFile(new URL(`../../src/${sheet}`, import.meta.url), "utf8");
      await page.addStyleTag({ content });
    }
    await page.addStyleTag({ content: ".view { height: 100vh; }" });
    await page.addScriptTag({ content: script });
    await page.evaluate(() => {
      const stage = document.querySelector<HTMLElement>(".stage");
      if (stage !== null) window.bench = window.makeBench?.(stage);
    });
  });

  const look = (position: Vec3, target: Vec3 = [0, 0, 0], more = {}) =>
    page.evaluate((view) => window.bench?.look(view), { position, target, ...more });
  const shoot = async (name: string) => {
    if (PICTURES) await page.screenshot({ path: `${PICTURES}/${name}.png` });
  };
  const stateNow = async () => {
    const state = await page.evaluate(() => window.bench?.state);
    if (state === undefined) throw new Error("the page has no bench");
    return state;
  };
  const project = async (point: Vec3) => {
    const place = await page.evaluate((each) => window.bench?.project(each), point);
    if (place === undefined) throw new Error("the page has no bench");
    return place;
  };
  const cutOpen = () =>
    page.evaluate(() => {
      const box = { min: [100, -350, 20], max: [900, -50, 180] } as const;
      const plane = { normal: [0.6, 0, 0.8], offset_um: 420 } as const;
      window.bench?.dispatch({ type: "set-clip", clip: { box, plane } });
    });

  it("have a scale bar that is correct within a pixel at any zoom and from any side", async () => {
    const texts = new Set<string>();
    for (const [position, target] of [
      [
        [0, 0, 2.2],
        [0, 0, 0],
      ],
      [
        [0.4, 0.3, 0.7],
        [0.1, 0, 0.05],
      ],
      [
        [-0.05, 0.1, 0.12],
        [0, 0.05, 0],
      ],
      [
        [3, 4, -5],
        [0.2, 0.1, 0],
      ],
    ] as const) {
      await look(position, target);
      const scale = await page.evaluate(() => window.bench?.scale());
      expect(Math.abs((scale?.shown_px ?? 0) - (scale?.true_px ?? 99))).toBeLessThan(1);
      expect(scale?.shown_px).toBeGreaterThan(60);
      texts.add(scale?.text ?? "");
    }
    expect(texts.size).toBeGreaterThan(2);
  });

  it("show the true distance of two measured points", async () => {
    await look([0.3, 0.2, 1.6]);
    const points = [
      [250, -200, 100],
      [550, -400, 130],
    ] as const;
    await page.evaluate((each) => window.bench?.measure(each), points);
    const label = await page.evaluate(() => window.bench?.label());
    expect(label?.text).toBe("362 µm"); // the root of 300² + 200² + 30² is 361.8
    expect(label?.draws).toBe(1);
    await page.evaluate((each) => window.bench?.measure(each), points);
    await look([0, 0, 1]);
    expect((await page.evaluate(() => window.bench?.label()))?.draws).toBe(1);
    await look([0.1, 0.3, 1.1]);
    await shoot("measure");
  });

  it("measure from surface to surface where the user taps", async () => {
    await look([0, 0, 1.6]);
    const tap = async (point: Vec3) => {
      const { x, y } = await project(point);
      return page.evaluate(([px, py]) => window.bench?.measureAt(px, py), [x, y] as const);
    };
    await tap([250, -200, 190]); // the poles of the balls
    const measured = await tap([750, -200, 190]);
    expect(measured).toHaveLength(2);
    [250, -200, 190, 750, -200, 190].forEach((v, i) => {
      expect(Math.abs((measured?.flat()[i] ?? 0) - v)).toBeLessThan(0.5); // the balls consist of flat faces
    });
    expect(await tap([250, -200, 190])).toHaveLength(1); // a third tap begins a new measurement
    expect((await stateNow()).measurements).toHaveLength(1);
  });

  it("set no point where a ray meets nothing, and announce that", async () => {
    await look([0.3, 0.2, 1.6]);
    const at = await project([500, -200, 100]); // between the balls, inside both boxes
    const points = await page.evaluate((p) => window.bench?.measureAt(p.x, p.y), at);
    expect(points).toEqual([]);
    expect(await page.evaluate(() => window.bench?.announced)).toContain("No point was set");
  });

  it("show an angle, and a line with its name in the list", async () => {
    await look([0.1, 0.1, 1.5]);
    await page.evaluate(() => {
      const { bench } = window;
      const at = (x: number, y: number) =>
        bench?.dispatch({ type: "add-point", point: [x, y, 190] });
      bench?.dispatch({ type: "set", id: "measure-kind", value: "line" });
      for (const [x, y] of [
        [100, -300],
        [300, -340],
        [450, -250],
        [700, -340],
      ])
        at(x, y);
      bench?.dispatch({ type: "set", id: "measure-kind", value: "angle" });
      at(250, -200);
      at(250, -50);
      at(400, -50);
    });
    expect((await page.evaluate(() => window.bench?.label()))?.text).toBe("90.0°");
    expect((await stateNow()).measurements.map(({ name }) => name)).toEqual(["Line 1"]);
    await shoot("angle-and-line");
  });

  it("free the GPU memory of removed measurements", async () => {
    await look([0.1, 0.1, 1.5]);
    const clear = () =>
      page.evaluate(() => {
        window.bench?.dispatch({ type: "measure", points: [] });
        window.bench?.dispatch({ type: "set-measurements", measurements: [] });
        return window.bench?.held;
      });
    const measure = (lines: number, points: number) =>
      page.evaluate(
        ([count, length]) => {
          window.bench?.dispatch({ type: "set", id: "measure-kind", value: "line" });
          for (let line = 0; line < count; line++) {
            for (let i = 0; i < length; i++) {
              window.bench?.dispatch({ type: "add-point", point: [100 + 90 * i, -40 * line, 190] });
            }
            if (line < count - 1) window.bench?.dispatch({ type: "finish-measuring" });
          }
          return window.bench?.held;
        },
        [lines, points] as const,
      );
    await measure(1, 2);
    const before = await clear();
    const shown = await measure(4, 5);
    expect(shown?.geometries).toBeGreaterThan((before?.geometries ?? 0) + 20);
    expect(await clear()).toEqual(before);
  });

  it("have labels that do not overlap, although the labelled lines cross", async () => {
    await look([0.1, 0.1, 1.5]);
    await page.evaluate(() => {
      const { bench } = window;
      // Three distances have the same midpoint, and the ends of the last one have labels with values.
      for (const [x, y] of [
        [200, 0],
        [0, 100],
        [150, 10],
      ]) {
        for (const sign of [-1, 1]) {
          bench?.dispatch({ type: "add-point", point: [500 + sign * x, -200 + sign * y, 190] });
        }
      }
    });
    await page.waitForTimeout(300);
    const boxes = await page.evaluate(() => window.bench?.labelBoxes() ?? []);
    expect(boxes.length).toBeGreaterThanOrEqual(3);
    boxes.forEach((a, i) => {
      for (const b of boxes.slice(i + 1)) {
        const isBeside = a.x + a.width <= b.x || b.x + b.width <= a.x;
        const isAbove = a.y + a.height <= b.y || b.y + b.height <= a.y;
        expect(isBeside || isAbove, JSON.stringify([a, b])).toBe(true);
      }
    });
    await shoot("labels-apart");
  });

  it("show the channels' values at their points, on the source's scale", async () => {
    await look([0, 0, 1.6]);
    await page.evaluate(() =>
      window.bench?.measure([
        [250, -200, 190],
        [750, -200, 190],
      ]),
    );
    const at = (index: 0 | 1) => page.evaluate((i) => window.bench?.valuesAt(i), index);
    await expect.poll(() => at(1)).toBe("CD8 T cells 13107"); // 51 / 255 of 65535
    expect(await at(0)).toBe(""); // that tile has no volume
    await shoot("values");
    const measureAbove = (above_um: number) =>
      page.evaluate((z) => window.bench?.measure([[750, -200, z]]), 200 + above_um);
    await measureAbove(300);
    await expect.poll(() => at(0)).toBe("");
    await measureAbove(0.1); // surfaces extend slightly beyond the volume
    await expect.poll(() => at(0)).toBe("CD8 T cells 13107");
  });

  it("have labels of the same angular size from near and far", async () => {
    await page.evaluate(() =>
      window.bench?.measure([
        [400, -200, 190],
        [600, -200, 190],
      ]),
    );
    const angles: number[] = [];
    for (const distance of [0.5, 1, 4]) {
      await look([0.2 * distance, 0, distance]);
      angles.push((await page.evaluate(() => window.bench?.label()))?.angle_rad ?? 0);
    }
    const px_per_rad = HEIGHT / 2 / Math.tan((20 * Math.PI) / 180);
    for (const angle of angles) expect(angle * px_per_rad).toBeCloseTo(LABEL_PX, 1);
    await look([0, 0, 2], [0, 0, 0], { isStereo: true });
    const inStereo = (await page.evaluate(() => window.bench?.label()))?.angle_rad ?? 0;
    expect(inStereo).toBeCloseTo(STEREO_TEXT * LABEL_HEIGHT, 5);
  });

  it("have a handle that moves a face with the pointer, while the camera stays", async () => {
    await look([0, 0, 1.6]);
    await cutOpen();
    const from = await project([100, -200, 100]);
    const to = await project([300, -200, 100]);
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    await page.mouse.move((from.x + to.x) / 2, to.y);
    await page.mouse.move(to.x, to.y);
    await page.mouse.up();
    const { clip } = await stateNow();
    // The pointer is on the axis of the handle, where a pixel is 2.4 um.
    expect(Math.abs((clip.box?.min[0] ?? 0) - 300)).toBeLessThan(1);
    expect(clip.box?.min.slice(1)).toEqual([-350, 20]);
    expect(clip.box?.max).toEqual([900, -50, 180]);
    expect(await page.evaluate(() => window.bench?.leaked)).toBe(0);
    await page.mouse.click(5, 5);
    expect(await page.evaluate(() => window.bench?.leaked)).toBe(1);
  });

  it("have a handle that the gaze moves in a headset", async () => {
    await cutOpen();
    // A um is 1.2 mm in the scene, and the specimen's centre is at the origin.
    const gaze = (x_um: number) =>
      look([0, 0, 1.6], [(x_um - 500) * 1.2e-3, 0, 0], { isStereo: true });
    const handleUnderGaze = () => page.evaluate(() => window.bench?.meet());
    await gaze(903);
    const grip = await handleUnderGaze();
    // The cut existed before stereo began, so only a button grabs the handle.
    expect(grip).toMatchObject({ key: "handle:x-max", hold: "carry", isGlance: true });
    expect(grip?.distance_m).toBeCloseTo(Math.hypot(1.6, 0.48), 3);
    await gaze(250);
    expect(await handleUnderGaze()).toBeNull();
    await gaze(700);
    await page.evaluate(() => window.bench?.carry("handle:x-max"));
    expect((await stateNow()).clip.box?.max[0]).toBeCloseTo(700, 3);
    await gaze(703);
    expect(await handleUnderGaze()).toMatchObject({ key: "handle:x-max", isGlance: false });
    await page.evaluate(() => {
      window.bench?.dispatch({ type: "set-clip", clip: { box: null, plane: null } });
      window.bench?.carry("handle:x-max");
    });
    expect((await stateNow()).clip.box).toBeNull();
    expect(await handleUnderGaze()).toBeNull();
  });

  it("name the part under the gaze once the gaze rests", async () => {
    const name = () => page.evaluate(() => window.bench?.name());
    await look([-0.3, 0, 1.6], [-0.3, 0, 0], { dt_s: 0.1 });
    expect(await name()).toBe("");
    for (let i = 0; i < 5; i++) await look([-0.3, 0, 1.6], [-0.3, 0, 0], { dt_s: 0.1 });
    expect(await name()).toBe("row 1, column 1 · CD8 T cells");
    await shoot("name");
    const [mark, bar] = await page.evaluate(() =>
      [".name-mark", ".scale-bar"].map((each) =>
        document.querySelector(each)?.getBoundingClientRect().toJSON(),
      ),
    );
    expect(mark.bottom).toBeLessThan(bar.top); // just above the scale bar, away from the gaze
    expect(mark.top).toBeGreaterThan(0.75 * HEIGHT);
    expect([mark.left, mark.right < WIDTH / 2]).toEqual([bar.left, true]);
    await look([0.55, 0.2, 1.6], [0.55, 0.2, 0], { dt_s: 0.1 });
    expect(await name()).toBe("");
    for (let i = 0; i < 5; i++) await look([0.55, 0.2, 1.6], [0.55, 0.2, 0], { dt_s: 0.1 });
    expect(await name()).toBe("row 1, column 2");
  });

  it("turn the axes with the specimen, and name their directions", async () => {
    await look([0, 0, 1.6]);
    const label = () => page.locator(".orientation-mark").getAttribute("aria-label");
    expect(await label()).toBe("x leads right, y up, z towards you");
    await page.evaluate(() => window.bench?.turn([0, 1, 0], Math.PI / 2));
    expect(await label()).toBe("x leads away, y up, z right");
  });

  it("mark a patient's sides with letters, on the screen and beside the specimen", async () => {
    await page.evaluate(() => {
      window.bench?.dispose();
      const stage = document.querySelector<HTMLElement>(".stage");
      stage?.replaceChildren();
      // A head lies on its back, and its left is the world's +x, as in the reader's canonical axes.
      const sides = { left: [1, 0, 0], posterior: [0, -1, 0], superior: [0, 0, -1] } as const;
      const given = JSON.parse(JSON.stringify(sides));
      if (stage !== null) window.bench = window.makeBench?.(stage, given);
    });
    await look([0, 0, 1.6]);
    const mark = page.locator(".orientation-mark");
    expect(await mark.getAttribute("aria-label")).toBe(
      "the patient's left leads right, the head away, the front up",
    );
    const placeOf = async (letter: string) => {
      const box = await mark.locator(`[data-axis="${letter}"] text`).boundingBox();
      return {
        x: (box?.x ?? 0) + (box?.width ?? 0) / 2,
        y: (box?.y ?? 0) + (box?.height ?? 0) / 2,
      };
    };
    const [l, r, a, p] = await Promise.all(["L", "R", "A", "P"].map(placeOf));
    expect(l.x - r.x).toBeGreaterThan(40);
    expect(p.y - a.y).toBeGreaterThan(40);
    const visibility = (letter: string) =>
      mark.locator(`[data-axis="${letter}"] text`).getAttribute("visibility");
    expect(await Promise.all(["S", "I"].map(visibility))).toEqual(["hidden", "inherit"]);
    await page.evaluate(() => window.bench?.turn([0, 1, 0], Math.PI)); // seen from behind
    expect((await placeOf("L")).x - (await placeOf("R")).x).toBeLessThan(-40);
    await look([0.8, 0.7, 1.5]);
    await shoot("sides");
    await look([0.8, 0.7, 1.5], [0, 0, 0], { isStereo: true });
    await shoot("sides-stereo");
    expect(await mark.isVisible()).toBe(false);
  });

  it("stand beside the specimen in a headset, and not on the screen", async () => {
    await look([0.5, 0.4, 1.7], [0, 0, 0], { isStereo: true });
    const ruler = await page.evaluate(() => window.bench?.ruler());
    expect(ruler?.isVisible).toBe(true);
    expect(ruler?.length_um).toBeGreaterThan(100);
    await look([0.5, 0.4, 1.7], [0, 0, 0], { isStereo: true, isInUsersRoom: true });
    const onTable = await page.evaluate(() => window.bench?.ruler());
    const { up_um = Number.NaN } = ruler ?? {};
    expect(up_um).toBeGreaterThan(onTable?.up_um ?? Number.NaN); // otherwise the scale bar would be in front of it
    await look([0.5, 0.4, 1.7], [0, 0, 0], { isStereo: true, isPanelOpen: true });
    const behindPanel = await page.evaluate(() => window.bench?.ruler());
    expect(behindPanel).toMatchObject({ isVisible: false, hasAxes: false });
    for (const mark of [".scale-bar", ".orientation-mark", ".name-mark"]) {
      expect(await page.locator(mark).isVisible()).toBe(false);
    }
    for (let i = 0; i < 6; i++) {
      await look([0.5, 0.4, 1.7], [-0.3, 0, 0.05], { isStereo: true, dt_s: 0.1 });
    }
    await shoot("stereo");
    await look([0, 0, 1.6]);
    expect((await page.evaluate(() => window.bench?.ruler()))?.isVisible).toBe(false);
    expect(await page.locator(".scale-bar").isVisible()).toBe(true);
  });

  it("show handles, the box and the plane's cut", async () => {
    await look([0.7, 0.5, 1.3]);
    const bare = await page.evaluate(() => window.bench?.memory());
    await cutOpen();
    await page.evaluate(() =>
      window.bench?.measure([
        [250, -200, 190],
        [750, -200, 190],
      ]),
    );
    await shoot("handles");
    const before = await page.evaluate(() => window.bench?.memory());
    await page.evaluate(() => window.bench?.dispose());
    const after = await page.evaluate(() => window.bench?.memory());
    expect(before?.textures).toBeGreaterThan(bare?.textures ?? 99);
    expect(after?.textures).toBe(bare?.textures);
    // three.js keeps one square, which all sprites share.
    expect(after?.geometries).toBe((bare?.geometries ?? 0) + 1);
  });
});
