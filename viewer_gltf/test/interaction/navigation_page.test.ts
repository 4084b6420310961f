/**
 * Moving and zooming on a flat screen, by mouse and by two fingers. Neither turns the view, and the
 * specimen stays near however far it is pushed.
 */
import { beforeEach, expect, it } from "vitest";
import { difference, isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";

/**
 * Pixels of the axes' mark in the corner, which is 76 pixels wide; half a degree is a quarter of a
 * pixel.
 */
const UNTURNED_PX = 0.25;
/** Share of the canvas that a specimen with its corner in the middle covers at least. */
const SEEN = 0.01;

describeInChromium("a moved and zoomed view", () => {
  const stand = prepareStand({ viewport: { width: 504, height: 240 }, hasTouch: true });
  const page = () => stand.viewer.page;

  beforeEach(async () => {
    await stand.open("&mode=off");
    await page().keyboard.press("ArrowRight"); // so the motion is not along an axis of the specimen
    await page().keyboard.press("ArrowDown");
    await stand.viewer.still();
  });

  /** The directions of the specimen's axes on screen. */
  const axes = () =>
    page()
      .locator(".orientation-mark line")
      .evaluateAll((lines) =>
        lines.flatMap((line) => ["x2", "y2"].map((name) => Number(line.getAttribute(name)))),
      );
  const scaleText = () => page().locator(".scale-bar").textContent();

  async function expectSeenFrom(before: readonly number[]): Promise<void> {
    await stand.viewer.still();
    const now = await axes();
    expect(now).toHaveLength(before.length);
    now.forEach((v, i) => {
      expect(Math.abs(v - before[i])).toBeLessThan(UNTURNED_PX);
    });
    const picture = await takePicture(page());
    const seen = picture.count((pixel) => !isBackground(pixel));
    expect(seen / (picture.width * picture.height)).toBeGreaterThan(SEEN);
  }

  const look = async () => (await stand.viewer.snapshot()).look;
  const away = ({ position, target }: Awaited<ReturnType<typeof look>>) =>
    Math.hypot(...position.map((v, i) => v - target[i]));

  /** A place in the window where the specimen is seen, and the canvas. */
  async function findSpot() {
    const picture = await takePicture(page());
    const spots = Array.from({ length: picture.width * picture.height }, (_, i) => i)
      .map((i) => [i % picture.width, Math.floor(i / picture.width)] as const)
      .filter(([x, y]) => !isBackground(picture.at(x, y)));
    const stage = await page().locator(".stage canvas").boundingBox();
    if (stage === null) throw new Error("no stage");
    const scale = stage.width / picture.width;
    const [x, y] = spots[Math.floor(spots.length / 2)];
    return { stage, x: stage.x + scale * x, y: stage.y + scale * y };
  }

  it("flies to a double-clicked place, isolates nothing, and stays if nothing is hit", async () => {
    const { stage, x, y } = await findSpot();
    const before = await look();
    await page().mouse.dblclick(x, y);
    await expect.poll(async () => away(await look())).toBeLessThan(0.75 * away(before));
    await stand.viewer.still();
    expect((await stand.viewer.snapshot()).state.isolated).toBeNull();
    const there = await look();
    await page().keyboard.press("r"); // back to the view with an empty corner
    await stand.viewer.still();
    const whole = await look();
    expect(away(whole)).toBeGreaterThan(away(there));
    await page().mouse.dblclick(stage.x + 2, stage.y + stage.height / 2);
    await stand.viewer.still();
    expect(await look()).toEqual(whole);
    expect(await page().locator("[data-announcement]").textContent()).toBe(
      "There is nothing to fly to.",
    );
  });

  it("flies to a place that is tapped twice by a finger that rolls slightly", async () => {
    const { x, y } = await findSpot();
    const before = await look();
    // in one call, because more time than a double tap allows may pass between a test's own taps
    await page().evaluate(
      ([x, y]) => {
        const canvas = document.querySelector(".stage canvas") as HTMLCanvasElement;
        canvas.setPointerCapture = () => undefined; // the system does not know this finger
        canvas.releasePointerCapture = () => undefined;
        const send = (type: string, rolled_px: number) =>
          canvas.dispatchEvent(
            new PointerEvent(type, {
              ...{ pointerId: 7, pointerType: "touch", isPrimary: true, bubbles: true },
              ...{ clientX: x + rolled_px, clientY: y },
            }),
          );
        for (let tap = 0; tap < 2; tap++) {
          send("pointerdown", 0);
          send("pointerup", 9);
        }
      },
      [x, y],
    );
    await expect.poll(async () => away(await look())).toBeLessThan(0.75 * away(before));
  });

  it("is not turned by the right button, even beyond the end of the specimen", async () => {
    const before = await axes();
    const start = await takePicture(page());
    for (const [dx, dy] of [
      [160, 0],
      [160, 0],
      [160, 30],
      [0, 160],
      [160, 160],
    ]) {
      await page().mouse.move(40, 40);
      await page().mouse.down({ button: "right" });
      await page().mouse.move(40 + dx, 40 + dy, { steps: 6 });
      await page().mouse.up({ button: "right" });
      await expectSeenFrom(before);
    }
    expect(difference(start, await takePicture(page()))).toBeGreaterThan(SEEN);
  });

  type Point = readonly [number, number];

  /** Moves two fingers from where they go down to where they are lifted. */
  async function twoFingers(from: readonly [Point, Point], to: readonly [Point, Point]) {
    const devtools = await page().context().newCDPSession(page());
    const at = (share: number) =>
      from.map(([x, y], id) => ({
        x: x + share * (to[id][0] - x),
        y: y + share * (to[id][1] - y),
        id,
      }));
    const touch = (type: "touchStart" | "touchMove" | "touchEnd", points: ReturnType<typeof at>) =>
      devtools.send("Input.dispatchTouchEvent", { type, touchPoints: points });
    await touch("touchStart", at(0).slice(0, 1));
    await touch("touchStart", at(0));
    for (let i = 1; i <= 6; i++) await touch("touchMove", at(i / 6));
    await touch("touchEnd", []);
    await devtools.detach();
  }

  it.runIf(IS_EXHAUSTIVE)("is not turned by two fingers", async () => {
    const before = await axes();
    const start = await takePicture(page());
    for (let i = 0; i < 5; i++) {
      await twoFingers(
        [
          [30, 60],
          [80, 60],
        ],
        [
          [170, 90],
          [220, 90],
        ],
      );
      await expectSeenFrom(before);
    }
    expect(difference(start, await takePicture(page()))).toBeGreaterThan(SEEN);
  });

  it("is zoomed by a pinch, without turning", async () => {
    const before = await axes();
    const scale = await scaleText();
    await twoFingers(
      [
        [100, 110],
        [130, 110],
      ],
      [
        [70, 110],
        [160, 110],
      ],
    );
    await expectSeenFrom(before);
    expect(await scaleText()).not.toBe(scale);
  });

  it("is zoomed by the wheel about the point that is looked at", async () => {
    for (const key of ["Shift+ArrowRight", "Shift+ArrowUp"]) await page().keyboard.press(key);
    await stand.viewer.still();
    const before = await axes();
    const start = await takePicture(page());
    const scale = await scaleText();
    await page().mouse.move(60, 60); // the pointer is elsewhere
    for (let i = 0; i < 6; i++) await page().mouse.wheel(0, -100);
    await expectSeenFrom(before);
    expect(await scaleText()).not.toBe(scale);
    for (let i = 0; i < 6; i++) await page().mouse.wheel(0, 100);
    await expectSeenFrom(before);
    expect(difference(start, await takePicture(page()))).toBeLessThan(SEEN);
  });
});
