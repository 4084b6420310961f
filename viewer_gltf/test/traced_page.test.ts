/**
 * The page in its path-traced mode: it opens so for a scan of a whole body, gathers at rest, begins
 * anew with what paths depend on, and with nothing else.
 */
import { expect, it } from "vitest";
import type { Manifest } from "../src/bundle/generated/bundle";
import { DIALS } from "../src/trace/dials";
import { project } from "./driver/camera";
import { addHeadset } from "./driver/chromium";
import { hasColor, isBackground, type Picture, takePicture } from "./driver/picture";
import { describeInChromium } from "./driver/skip";
import { prepareStand } from "./driver/stand";
import { BALLS, SPECIMEN } from "./fixture/bodies";
import { BODIES } from "./fixture/bundle";

type FilePayload = { name: string; mimeType: string; buffer: Buffer };

const [F, BALL] = BODIES;
const STUDIO = "/app/environments/studio.hdr";
const PATIENT = { timeout: 120_000 };
const bounds = SPECIMEN as unknown as Manifest["specimen"]["bounds_um"];

/** A picture of light, 4 x 2, all of one colour: Radiance's format, not packed. */
function hdr(red: number, green: number, blue: number): Buffer {
  const head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n";
  const texel = [red, green, blue].map((v) => Math.round(128 * v));
  return Buffer.concat([
    Buffer.from(head, "ascii"),
    Buffer.from(Array.from({ length: 8 }, () => [...texel, 129]).flat()), // of 2
  ]);
}

/** How much two pictures differ, in the mean of all that either shows; of 255. */
function apart(a: Picture, b: Picture): number {
  const shown = a.where((pixel) => !isBackground(pixel));
  const sum = shown.reduce(
    (all, [x, y]) => all + a.at(x, y).reduce((off, v, i) => off + Math.abs(v - b.at(x, y)[i]), 0),
    0,
  );
  return sum / 3 / shown.length;
}

describeInChromium("the path-traced page", () => {
  const stand = prepareStand({ viewport: { width: 320, height: 200 } });
  const page = () => stand.viewer.page;
  const snapshot = () => stand.viewer.snapshot();
  const trace = async () => (await snapshot()).state.trace;
  const notices = async () => (await snapshot()).state.notices;
  const samples = async () => (await snapshot()).traced.samples;
  const drawn = (picture: Picture) => picture.count((pixel) => !isBackground(pixel));

  /** As a scan of a whole body: the bundle says so. */
  async function open(query = "&quality=low"): Promise<void> {
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
  /** Of a picture with nothing said over it. */
  async function shoot(least = 10): Promise<Picture> {
    await gathered(least);
    const said = () => page().locator("[data-said]").textContent();
    await expect.poll(said, PATIENT).toBe("");
    return takePicture(page());
  }

  it("shows a scan, gathers, and changes only what a key or a slider is for", async () => {
    await open();
    expect((await snapshot()).state.mode).toBe("traced");
    expect(stand.host.requests.filter(({ path }) => path.endsWith(".glb"))).toEqual([]);
    const early = await shoot();
    expect(drawn(early)).toBeGreaterThan(1000);
    for (const { color } of [F, BALL]) expect(early.count(hasColor(color))).toBeGreaterThan(100);
    const late = await shoot((await samples()) + 12);
    expect(apart(early, late)).toBeLessThan(10);

    // before and after: at once, of the same samples
    const before = await samples();
    await press("Z");
    await expect.poll(async () => (await trace()).isPostOn).toBe(false);
    expect(await samples()).toBeGreaterThanOrEqual(before);
    const plain = apart(late, await shoot());
    expect(plain).toBeGreaterThan(6);
    await press("Z");
    await expect.poll(async () => (await trace()).isPostOn).toBe(true);
    const again = apart(late, await shoot());
    expect(again).toBeLessThan(0.7 * plain);

    // a lamp elsewhere
    const keys = DIALS.findIndex(({ id }) => id === "lamp-0/x") + 1;
    await press(...new Array<string>(keys).fill("F"));
    const many = await samples();
    await press(...new Array<string>(20).fill("]")); // each a sixtieth of the way
    await expect.poll(async () => (await trace()).lamps[0].x).toBeCloseTo(1.1, 4);
    expect(await samples()).toBeLessThan(many);
    const lit = await shoot();
    expect(apart(late, lit)).toBeGreaterThan(8);

    // a channel that is hidden, and one of another colour
    await press("2");
    await stand.viewer.settled();
    const alone = await shoot();
    expect(alone.count(hasColor(BALL.color))).toBeLessThan(20);
    expect(alone.count(hasColor(F.color))).toBeGreaterThan(100);
    await stand.viewer.recolor(F.id, "#00ff00");
    expect((await shoot()).count(hasColor([0, 1, 0]))).toBeGreaterThan(100);

    // out of the mode and back
    await press("G");
    await stand.viewer.settled();
    expect((await snapshot()).state.mode).toBe("all");
    expect((await snapshot()).traced.level).toBeNull();
    expect((await snapshot()).volumes.length).toBeGreaterThan(0);
    await press("G");
    await stand.viewer.settled();
    await gathered(8);
    expect(await notices()).toEqual([]);

    // a link brings all of it back
    await press("Z", "I", "M", "l");
    await expect.poll(() => page().url()).toContain("light=");
    const wanted = await trace();
    const address = page().url();
    await page().goto("about:blank");
    await stand.viewer.open(address);
    await stand.viewer.settled();
    expect(await trace()).toEqual(wanted);
    expect(wanted.environment).toBe("sky");
    expect(await notices()).toEqual([]);
  });

  it("is cut open, and measured", async () => {
    await open("&quality=low#v=1&mode=traced&dwell=off");
    const whole = await shoot(8);
    const right = (picture: Picture, from: number) => {
      const handle_y = picture.height / 2;
      return picture
        .where((pixel) => !isBackground(pixel))
        .filter(([x, y]) => x > from && Math.abs(y - handle_y) > 22).length;
    };
    const { width, height } = whole;
    const at = (p: readonly [number, number, number]) => project(p, bounds, width, height);
    const edge = Math.max(at([34, -48, 24]).x, at([34, 0, 24]).x) + 2;
    expect(right(whole, edge)).toBeGreaterThan(50);
    await page().goto("about:blank");
    await open("&quality=low#v=1&mode=traced&dwell=off&cut=1,0,0,34");
    const cut = await shoot(8);
    expect(right(cut, edge)).toBe(0);
    expect(drawn(cut)).toBeGreaterThan(500);

    await press("n", "p"); // whole again; a tap measures
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

  it("is lit by a file of the user's, and survives a lost context", async () => {
    await page().addInitScript(() => {
      const original = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, ...given) {
        const made = (original as (...each: unknown[]) => unknown).apply(this, given);
        if (made instanceof WebGL2RenderingContext) Object.assign(window, { drawnBy: made });
        return made as never;
      };
    });
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
    await press("Delete", "!"); // its notice, and the lamp
    expect((await trace()).lamps[0].isOn).toBe(false);
    await light("green.hdr", hdr(0, 1, 0));
    await expect.poll(async () => (await trace()).environment, PATIENT).toBe("own");
    await stand.viewer.settled();
    const green = await shoot();
    expect(drawn(green)).toBeGreaterThan(1000);
    const isGreen = hasColor([0, 1, 0]);
    const others = green.count((pixel) => Math.max(...pixel) > 60 && !isGreen(pixel));
    expect(others).toBeLessThan(0.03 * drawn(green));

    const call = (name: "loseContext" | "restoreContext") =>
      page().evaluate((each) => {
        const held = window as unknown as {
          drawnBy: WebGL2RenderingContext;
          loss?: WEBGL_lose_context | null;
        };
        held.loss ??= held.drawnBy.getExtension("WEBGL_lose_context");
        held.loss?.[each]();
      }, name);
    await call("loseContext");
    await expect.poll(notices).toEqual([expect.stringContaining("dropped the picture")]);
    await call("restoreContext");
    await expect.poll(notices).toEqual([]);
    await stand.viewer.settled();
    const back = await shoot();
    expect(apart(green, back)).toBeLessThan(8);
  });

  it("says once that the light can't be had, and tries again when asked", async () => {
    stand.host.overrides.set(STUDIO, { status: 503, body: "" });
    await open();
    await expect.poll(notices, PATIENT).toHaveLength(1);
    await press("2", "1", "2"); // what changes the state does not ask again
    await stand.viewer.settled();
    expect(await notices()).toHaveLength(1);
    stand.host.overrides.delete(STUDIO);
    await press("1", "R");
    await expect.poll(notices, PATIENT).toEqual([]);
    expect(drawn(await shoot(8))).toBeGreaterThan(1000);
  });

  it("is drawn to both eyes, and gathers while the head rests", async () => {
    await addHeadset(page());
    await open("#v=1&mode=traced&dwell=off&quality=low");
    await stand.viewer.enterStereo();
    await gathered(8);
    const { width, height } = { width: 160, height: 200 };
    for (const x of [0, width]) {
      const eye = await takePicture(page(), { x, y: 0, width, height });
      expect(eye.count(hasColor(F.color)), `eye at ${x}`).toBeGreaterThan(20);
      expect(eye.count(hasColor(BALL.color)), `eye at ${x}`).toBeGreaterThan(20);
    }
    const before = await samples();
    await page().evaluate(() => {
      const { headset } = window as unknown as { headset: import("iwer").XRDevice };
      headset.position.set(0.3, 1.7, 0.1); // a real step
    });
    await expect.poll(samples, PATIENT).toBeLessThan(before);
    await gathered(4);
    expect(await notices()).toEqual([]);
  });
});
