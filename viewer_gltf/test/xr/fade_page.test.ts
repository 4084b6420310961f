/**
 * The scene in stereo: a jump of the specimen is a fade, and the grid on the ground stays in place.
 */
import { expect, it } from "vitest";
import { addClock, holdFrames, tick } from "../support/browser/clock";
import { type Picture, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { Gazer } from "../support/xr/gazer";

const SIZE = { width: 320, height: 144 };
const FRAME_MS = 50;
/** Number of frames after which a fade of 0.25 s is over. */
const FRAMES = 7;

/** Mean difference of the colours, 0 to 255. */
function apart(a: Picture, b: Picture): number {
  let sum = 0;
  for (let y = 0; y < a.height; y++) {
    for (let x = 0; x < a.width; x++) {
      const other = b.at(x, y);
      a.at(x, y).forEach((v, i) => {
        sum += Math.abs(v - other[i]);
      });
    }
  }
  return sum / (3 * a.width * a.height);
}

describeInChromium("the frame in stereo", () => {
  const stand = prepareStand({ viewport: SIZE });
  const page = () => stand.viewer.page;
  // the part above the bar
  const picture = () => takePicture(page(), { x: 0, y: 0, width: SIZE.width, height: 88 });

  async function enter(): Promise<void> {
    await addClock(page());
    await page().addInitScript(() => localStorage.setItem("stereocell-introductions", "9"));
    await stand.open("&mode=off");
    await page().keyboard.press("P");
    await page().waitForFunction(() => window.stereocell?.snapshot().isStereo);
    await stand.viewer.settled();
    await holdFrames(page());
    await new Gazer(stand.viewer).turnTo(0, 0);
    await tick(page(), FRAME_MS, FRAMES);
  }

  /**
   * Differences of the frames after a key press from the frame before, relative to the last one.
   */
  async function changes(key: string): Promise<readonly number[]> {
    const before = await picture();
    await page().keyboard.press(key);
    const found: number[] = [];
    for (let k = 0; k < FRAMES; k++) {
      await tick(page(), FRAME_MS);
      found.push(apart(before, await picture()));
    }
    const last = found[FRAMES - 1];
    expect(last, key).toBeGreaterThan(1);
    return found.map((each) => each / last);
  }

  it("fades after a jump to a view, a reset or a tile, and follows a turn at once", async () => {
    await enter();
    await page().keyboard.press("ArrowLeft");
    await tick(page(), FRAME_MS, FRAMES);
    const jumps = ["y", "r", "i", "i"]; // the second "i" shows all tiles again
    for (const key of jumps) {
      const shares = await changes(key);
      expect(shares[0], key).toBeLessThan(0.2);
      expect(shares[2], key).toBeLessThan(0.8);
      shares.slice(1).forEach((share, i) => {
        expect(share, key).toBeGreaterThan(shares[i] - 0.05);
        expect(share - shares[i], key).toBeLessThan(0.55); // there is no jump
      });
      expect(shares[FRAMES - 2], key).toBeGreaterThan(0.97);
    }
    const [turned] = await changes("ArrowLeft");
    expect(turned).toBeGreaterThan(0.9);
  });

  it("has a faint grid on the ground, also behind the user", async () => {
    await enter();
    const gazer = new Gazer(stand.viewer);
    await gazer.turnTo(0, 0);
    await gazer.turnTo(140, -20);
    await tick(page(), FRAME_MS, FRAMES);
    const dark = 0x0b + 0x0d + 0x12; // the background
    const sum = ([r, g, b]: readonly [number, number, number]) => r + g + b;
    const shown = await picture();
    expect(shown.count((pixel) => sum(pixel) > dark + 12)).toBeGreaterThan(100);
    expect(shown.count((pixel) => Math.max(...pixel) > 110)).toBe(0);
  });
});
