/**
 * The page in the mode of path tracing. It opens in this mode for a scan of a whole body, gathers samples at rest, and
 * restarts only after changes on which paths depend.
 */
import { expect, it } from "vitest";
import type { Manifest } from "../../src/bundle/generated/bundle";
import { place } from "../../src/render/placement";
import { LIGHT_NUMBERS } from "../../src/state/parameters/light";
import { ENOUGH_SAMPLES } from "../../src/state/path_trace_settings";
import { project } from "../support/browser/camera";
import { addHeadset } from "../support/browser/chromium";
import { changeContext, rememberContext } from "../support/browser/graphics_context";
import {
  hasColor,
  isBackground,
  type Picture,
  type Pixel,
  takePicture,
} from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { BALLS, SPECIMEN } from "../support/fixture/bodies";
import { BODIES } from "../support/fixture/bundle";

type FilePayload = { name: string; mimeType: string; buffer: Buffer };

const [F, BALL] = BODIES;
const STUDIO = "/app/environments/studio.hdr";
/** Size of the page, CSS pixels; small because paths are traced in software. */
const VIEWPORT = { width: 168, height: 104 };
const PATIENT = { timeout: 120_000 };
const bounds = SPECIMEN as unknown as Manifest["specimen"]["bounds_um"];

/** An environment map of 4 x 2 texels of one colour, in Radiance's format without compression. */
function hdr(red: number, green: number, blue: number): Buffer {
  const head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n";
  const texel = [red, green, blue].map((v) => Math.round(128 * v));
  return Buffer.concat([
    Buffer.from(head, "ascii"),
    Buffer.from(Array.from({ length: 8 }, () => [...texel, 129]).flat()), // exponent for values up to 2
  ]);
}

/** Mean difference of two pictures over all pixels that either one shows, of 255. */
function apart(a: Picture, b: Picture): number {
  const shown = a.where((pixel) => !isBackground(pixel));
  const sum = shown.reduce(
    (all, [x, y]) => all + a.at(x, y).reduce((off, v, i) => off + Math.abs(v - b.at(x, y)[i]), 0),
    0,
  );
  return sum / 3 / shown.length;
}

/** Mean colour of all pixels of a kind, 0 to 255. */
function meanColor(picture: Picture, isOfKind: (pixel: Pixel) => boolean): readonly number[] {
  const shown = picture.where(isOfKind);
  return [0, 1, 2].map(
    (k) => shown.reduce((sum, [x, y]) => sum + picture.at(x, y)[k], 0) / shown.length,
  );
}

/** Mean colour within the outlines, which are wider in a coarser or noisier picture. */
function meanWithin(picture: Picture): readonly number[] {
  const { width, height } = picture;
  const isDrawn = (x: number, y: number) =>
    x >= 0 && y >= 0 && x < width && y < height && !isBackground(picture.at(x, y));
  const inner = picture
    .where((pixel) => !isBackground(pixel))
    .filter(([x, y]) => [-2, 2].every((d) => isDrawn(x + d, y) && isDrawn(x, y + d)));
  expect(inner.length).toBeGreaterThan(100);
  return [0, 1, 2].map(
    (k) => inner.reduce((sum, [x, y]) => sum + picture.at(x, y)[k], 0) / inner.length,
  );
}

const between = (a: readonly number[], b: readonly number[]) => a.map((v, k) => v - b[k]);

describeInChromium("the path-traced page", () => {
  const stand = prepareStand({ viewport: VIEWPORT, pixelRatio: 1 });
  const page = () => stand.viewer.page;
  const snapshot = () => stand.viewer.snapshot();
  const trace = async () => (await snapshot()).state.trace;
  const notices = async () => (await snapshot()).state.notices;
  const samples = async () => (await snapshot()).traced.samples;
  const drawn = (picture: Picture) => picture.count((pixel) => !isBackground(pixel));

  /** Part of a link for paths that scatter only once, which is faster and sufficient for most tests. */
  const ONCE = "light=many:false";
  /** Opens the bundle as a scan of a whole body, by a field of its manifest. */
  async function open(query = `&quality=low#v=1&${ONCE}`): Promise<void> {
    const { manifest } = stand;
    const scan = { ...manifest, specimen: { ...manifest.specimen, modality: "MR" } };
    stand.host.overrides.set("/bundle/manifest.json", { status: 200, body: JSON.stringify(scan) });
    await stand.open(query);
    await stand.viewer.settled();
  }
  const gathered = (least: number) => expect.poll(samples, PATIENT).toBeGreaterThanOrEqual(least);
  async function press(...keys: readonly string[]): Promise<void> {
    for (const key of keys) await page().keyboard.press(key);
  }
  /**
   * Takes a picture of at least `wanted` samples, also if tracing began again in between. Tracing stops at
   * ENOUGH_SAMPLES, which a busy machine may reach before the test looks.
   */
  async function shoot(wanted = 5): Promise<Picture> {
    const least = Math.min(wanted, ENOUGH_SAMPLES);
    await stand.viewer.settled();
    for (;;) {
      await gathered(least);
      const picture = await takePicture(page());
      if ((await samples()) >= least) return picture;
    }
  }

  /** Takes a picture at full resolution; the first pictures have a lower one, and wider outlines. */
  async function shootClear(): Promise<Picture> {
    let picture = await shoot(10);
    for (;;) {
      const next = await shoot((await samples()) + 10);
      if (Math.abs(drawn(next) / drawn(picture) - 1) < 0.02) return next;
      picture = next;
    }
  }

  it("shows a scan, gathers samples, and changes only the property of each key and slider", async () => {
    await open();
    expect((await snapshot()).state.mode).toBe("traced");
    expect(stand.host.requests.filter(({ path }) => path.endsWith(".glb"))).toEqual([]);
    const early = await shoot(10);
    expect(drawn(early)).toBeGreaterThan(340);
    for (const { color } of [F, BALL]) expect(early.count(hasColor(color))).toBeGreaterThan(34);
    const late = await shoot((await samples()) + 10);
    expect(apart(early, late)).toBeLessThan(12);

    // Settings that apply after tracing show at once, with the same samples.
    const clear = await shootClear();
    const before = await samples();
    await press("Z");
    await expect.poll(async () => (await trace()).isPostOn).toBe(false);
    expect(await samples()).toBeGreaterThanOrEqual(before);
    const plain = await shoot(10);
    await press("Z");
    await expect.poll(async () => (await trace()).isPostOn).toBe(true);
    const again = await shoot(10);
    // Means over many pixels contain hardly any noise. Outlines are left out, since they are wider in a noisy picture.
    const off = (picture: Picture) =>
      Math.hypot(...between(meanWithin(picture), meanWithin(clear)));
    expect(off(plain)).toBeGreaterThan(6);
    expect(off(again)).toBeLessThan(off(plain) / 2);

    // A lamp moves to another place.
    const keys = LIGHT_NUMBERS.findIndex(({ link }) => link === "lamp-0/x") + 1;
    await press(...new Array<string>(keys).fill("F"));
    const many = await samples();
    await press(...new Array<string>(20).fill("]")); // each press moves it by a sixtieth of its range
    await expect.poll(async () => (await trace()).lamps[0].x).toBeCloseTo(1.1, 4);
    expect(await samples()).toBeLessThan(many);
    const lit = await shoot();
    // Pixels are compared one by one, since one side gains the light that the other loses, and the mean stays.
    const ofF = (picture: Picture) => meanColor(picture, hasColor(F.color));
    expect(apart(again, lit)).toBeGreaterThan(8);
    expect(Math.hypot(...between(ofF(lit), ofF(again)))).toBeGreaterThan(6);

    // A channel is hidden, and another one changes its colour.
    await press("2");
    await stand.viewer.settled();
    const alone = await shoot();
    expect(alone.count(hasColor(BALL.color))).toBeLessThan(12);
    expect(alone.count(hasColor(F.color))).toBeGreaterThan(34);
    await stand.viewer.recolor(F.id, "#00ff00");
    expect((await shoot()).count(hasColor([0, 1, 0]))).toBeGreaterThan(34);

    // The mode is left and entered again.
    await press("G");
    await stand.viewer.settled();
    expect((await snapshot()).state.mode).toBe("all");
    expect((await snapshot()).traced.level).toBeNull();
    expect((await snapshot()).volumes.length).toBeGreaterThan(0);
    await press("G");
    await stand.viewer.settled();
    await gathered(4);
    expect(await notices()).toEqual([]);

    // A link restores all settings.
    await press("Z", "I", "M");
    const address = await stand.viewer.writeLink();
    const wanted = await trace();
    await page().goto("about:blank");
    await stand.viewer.open(address);
    await stand.viewer.settled();
    expect(await trace()).toEqual(wanted);
    expect(wanted.environment).toBe("sky");
    expect(await notices()).toEqual([]);
  });

  it("can be cut open and measured", async () => {
    await open(`&quality=low#v=1&mode=traced&dwell=off&${ONCE}`);
    const whole = await shoot(4);
    const right = (picture: Picture, from: number) => {
      const handle_y = picture.height / 2;
      return picture
        .where((pixel) => !isBackground(pixel))
        .filter(([x, y]) => x > from && Math.abs(y - handle_y) > 22).length;
    };
    const { width, height } = whole;
    const at = (p: readonly [number, number, number]) => project(p, bounds, width, height);
    const edge = Math.max(at([34, -48, 24]).x, at([34, 0, 24]).x) + 2;
    expect(right(whole, edge) / (width * height)).toBeGreaterThan(25 / (240 * 150));
    await page().goto("about:blank");
    await open(`&quality=low#v=1&mode=traced&dwell=off&cut=1,0,0,34&${ONCE}`);
    const cut = await shoot(6); // with so many samples the ray-marched frame is not used
    expect(right(cut, edge)).toBe(0);
    expect(drawn(cut)).toBeGreaterThan(280);

    await press("n", "p"); // the cut is removed, and a tap measures
    await stand.viewer.settled();
    const [ball] = BALLS;
    const { x, y } = at([...ball.center]);
    const box = await page().locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    await page().mouse.click(box.x + x, box.y + y);
    const measured = async () => (await snapshot()).state.measured;
    await expect.poll(async () => (await measured()).length, PATIENT).toBe(1);
    const [point] = await measured();
    const away = Math.hypot(...point.map((v, k) => v - ball.center[k]));
    expect(Math.abs(away - ball.radius)).toBeLessThan(1.5);
    expect(point[2]).toBeGreaterThan(ball.center[2]);
  });

  it("has a lamp that can be dragged around the specimen while the camera stays", async () => {
    const { scale, center } = place(bounds);
    const edge_m = 64 * scale;
    /** Returns the page's pixel of a point, given in longest edges from the centre, for an eye in front of it. */
    async function pixelOf([x, y, z]: readonly number[], eye_m: number) {
      const box = await page().locator(".stage").boundingBox();
      if (box === null) throw new Error("no stage");
      const px = box.height / 2 / Math.tan((20 * Math.PI) / 180) / (eye_m - z * edge_m);
      const middle = [box.x + box.width / 2, box.y + box.height / 2];
      return [middle[0] + px * x * edge_m, middle[1] - px * y * edge_m] as const;
    }
    async function eyeOf(): Promise<string> {
      return /eye=([^&]*)/.exec(await stand.viewer.writeLink())?.[1] ?? "";
    }
    expect(center).toEqual([32, -24, 12]);
    const light =
      "many:false,lamp-0/x:-0.6,lamp-0/y:0,lamp-0/z:0.8,lamp-0/strength:4,lamp-0/color:00ff00";
    await open(`&quality=low#v=1&mode=traced&dwell=off&eye=0,0,4,0,0,0&light=${light}`);
    const left = await shoot(6);
    await press("$");
    const start = await pixelOf([-0.6, 0, 0.8], 4);
    const end = await pixelOf([0.6, 0.25, Math.sqrt(0.5775)], 4);
    const isBallAt = (picture: Picture, [x, y]: readonly [number, number]) =>
      hasColor([0, 1, 0])(picture.at(Math.round(x), Math.round(y)));
    const before = await shoot(1);
    expect([start, end].map((at) => isBallAt(before, at))).toEqual([true, false]);
    await page().mouse.move(...start);
    await page().mouse.down();
    await page().mouse.move(...end, { steps: 4 });
    await page().mouse.up();
    await expect.poll(async () => (await trace()).lamps[0].x, PATIENT).toBeGreaterThan(0.5);
    const { x, y, z } = (await trace()).lamps[0];
    expect(Math.hypot(x, y, z)).toBeCloseTo(1, 6);
    expect(Math.hypot(x - 0.6, y - 0.25)).toBeLessThan(0.02); // half a pixel is 0.008
    expect(z).toBeGreaterThan(0.7);
    expect(isBallAt(await shoot(1), end)).toBe(true);
    expect(await eyeOf()).toBe("0,0,4,0,0,0");
    await press("$");
    const right = await shoot(6);
    expect(isBallAt(right, end)).toBe(false);
    expect(apart(left, right)).toBeGreaterThan(8);

    // A lamp beside the eye becomes visible.
    await press("r", "$");
    const eye_m = Number((await eyeOf()).split(",")[2]);
    expect(isBallAt(await shoot(1), await pixelOf([x, y, z], eye_m))).toBe(true);
  });

  it("is lit by a file of the user, and survives a lost context", async () => {
    await rememberContext(page());
    let chosen: FilePayload = { name: "", mimeType: "", buffer: Buffer.alloc(0) };
    page().on("filechooser", (chooser) => chooser.setFiles(chosen));
    await open();
    const light = async (name: string, buffer: Buffer) => {
      chosen = { name, mimeType: "image/vnd.radiance", buffer };
      await press("U");
    };
    await light("broken.hdr", Buffer.from("no picture of light"));
    await expect.poll(notices, PATIENT).toEqual([expect.stringMatching(/^broken\.hdr: expected/)]);
    expect((await trace()).environment).toBe("studio");
    await press("Delete", "!"); // closes its notice, and switches the lamp
    expect((await trace()).lamps[0].isOn).toBe(false);
    await light("green.hdr", hdr(0, 1, 0));
    await expect.poll(async () => (await trace()).environment, PATIENT).toBe("own");
    await stand.viewer.settled();
    const green = await shoot();
    expect(drawn(green)).toBeGreaterThan(340);
    const isGreen = hasColor([0, 1, 0]);
    const others = (picture: Picture) =>
      picture.count((pixel) => Math.max(...pixel) > 60 && !isGreen(pixel));
    expect(others(green)).toBeLessThan(0.03 * drawn(green));

    await changeContext(page(), "loseContext");
    await expect.poll(notices).toEqual([expect.stringContaining("dropped the view")]);
    await changeContext(page(), "restoreContext");
    await expect.poll(notices).toEqual([]);
    await stand.viewer.settled();
    const back = await shoot();
    // All pixels are counted together, since single pixels are noisy after a few samples. A busy machine draws a
    // coarser picture with wider outlines.
    expect(Math.abs(drawn(back) / drawn(green) - 1)).toBeLessThan(0.25);
    expect(others(back)).toBeLessThan(0.03 * drawn(back));
    const [was, is] = [green, back].map(meanWithin);
    for (const [k, v] of is.entries()) expect(Math.abs(v - was[k])).toBeLessThan(8);
  });

  it.runIf(IS_EXHAUSTIVE)(
    "reports once that the light can't be had, and tries again when asked",
    async () => {
      stand.host.overrides.set(STUDIO, { status: 503, body: "" });
      await open();
      await expect.poll(notices, PATIENT).toHaveLength(1);
      await press("2", "1", "2"); // other changes of the state do not request it again
      await stand.viewer.settled();
      expect(await notices()).toHaveLength(1);
      stand.host.overrides.delete(STUDIO);
      await press("1", "R");
      await expect.poll(notices, PATIENT).toEqual([]);
      expect(drawn(await shoot(4))).toBeGreaterThan(340);
    },
  );

  it("reports that the code of path tracing could not be loaded, and loads it when asked again", async () => {
    await page().route(/\/path_tracer-[^/]*\.js$/, (route) => route.abort());
    await open();
    await expect
      .poll(notices, PATIENT)
      .toEqual([expect.stringContaining("path tracing could not be loaded")]);
    await press("2", "1", "2"); // other changes of the state do not request the code again
    await stand.viewer.settled();
    expect(await notices()).toHaveLength(1);
    await page().unroute(/\/path_tracer-[^/]*\.js$/);
    await press("1", "R");
    await expect.poll(notices, PATIENT).toEqual([]);
    expect(drawn(await shoot(2))).toBeGreaterThan(340);
  });

  it("is drawn for both eyes, and gathers samples while the head rests", async () => {
    const { width, height } = { width: 72, height: 90 }; // pixels of each eye
    await page().setViewportSize({ width: 2 * width, height });
    await addHeadset(page(), true);
    await open(`#v=1&mode=traced&dwell=off&quality=low&${ONCE}`);
    await stand.viewer.enterStereo();
    await gathered(4);
    for (const x of [0, width]) {
      const eye = await takePicture(page(), { x, y: 0, width, height });
      expect(eye.count(hasColor(F.color)), `eye at ${x}`).toBeGreaterThan(12);
      expect(eye.count(hasColor(BALL.color)), `eye at ${x}`).toBeGreaterThan(12);
    }
    await page().evaluate(() => {
      const { headset } = window as unknown as { headset: import("iwer").XRDevice };
      const { x, y, z } = headset.position;
      let k = 0;
      const trembling = window.setInterval(() => {
        k++; // the head moves by a millimetre in all directions
        headset.position.set(x + 1e-3 * Math.sin(k), y + 1e-3 * Math.cos(2 * k), z);
      }, 5);
      Object.assign(window, { trembling });
    });
    const resting = await samples();
    await gathered(resting + 3); // no sample is lost
    const before = await samples();
    await page().evaluate(() => {
      const { headset, trembling } = window as unknown as {
        headset: import("iwer").XRDevice;
        trembling: number;
      };
      window.clearInterval(trembling);
      headset.position.set(0.3, 1.7, 0.1); // a step, which is more than trembling
    });
    await expect.poll(samples, PATIENT).toBeLessThan(before);
    await gathered(4);
    expect(await notices()).toEqual([]);
  });
});
