/** A gaze that rests on a control of the split screen does exactly one thing, on the whole page. */
import { join } from "node:path";
import { expect, it } from "vitest";
import { addClock, holdFrames } from "../support/browser/clock";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { Gazer } from "../support/xr/gazer";

const SHOTS = process.env.STEREOCELL_SHOTS;
const SIZE = SHOTS ? { width: 1600, height: 720 } : { width: 320, height: 144 };

describeInChromium("a gaze that rests on the page's panel", () => {
  const stand = prepareStand({ viewport: SIZE, pixelRatio: SHOTS ? 1 : undefined });
  const menu = async () => (await stand.viewer.snapshot()).menu.map(({ id }) => id);
  const channels = async () => (await stand.viewer.snapshot()).state.channels;

  /** Nine channels fill the panel, and one of them lies where the opening button was. */
  async function enter(): Promise<Gazer> {
    const { page } = stand.viewer;
    const { channels: few, ...rest } = stand.manifest;
    const more = Array.from({ length: 9 - few.length }, (_, i) => ({
      ...few[few.length - 1],
      id: `marker_${i}`,
      name: `Marker ${i}`,
    }));
    const body = JSON.stringify({ ...rest, channels: [...few, ...more] });
    stand.host.overrides.set("/bundle/manifest.json", { status: 200, body });
    await addClock(page);
    await page.addInitScript(() => {
      localStorage.setItem("stereocell-introductions", "9"); // no introduction card
      localStorage.setItem("stereocell-screen", "240"); // CSS pixels per inch of the phone's screen
    });
    await stand.open("&mode=off");
    await page.keyboard.press("P");
    await page.waitForFunction(() => window.stereocell?.snapshot().isStereo);
    await holdFrames(page);
    const gazer = new Gazer(stand.viewer);
    await gazer.turnTo(0, 0);
    return gazer;
  }

  const shoot = async (name: string) => {
    if (SHOTS) await stand.viewer.page.screenshot({ path: join(SHOTS, `${name}.png`) });
  };

  it("opens the menu and does nothing more, even if it stays", async () => {
    const gazer = await enter();
    const before = (await stand.viewer.snapshot()).state;
    await gazer.lookAt("opener");
    await gazer.rest(2);
    expect((await menu()).length).toBeGreaterThan(1);
    const opened = await menu();
    expect(opened).toContain("marker_1/open");
    await shoot("menu_opened");
    await gazer.rest(6);
    await shoot("menu_rested");
    expect(await menu()).toEqual(opened);
    expect((await stand.viewer.snapshot()).state).toEqual(before);
  });

  it("hides only one channel, and keeps its row in place", async () => {
    const gazer = await enter();
    await gazer.lookAt("opener");
    await gazer.rest(2);
    const [first, ...others] = await channels();
    const places = async () =>
      (await stand.viewer.snapshot()).menu.map(({ id, up_deg }) => [id, Math.round(up_deg)]);
    await gazer.lookAt(`${first.id}/shown`);
    await shoot("channels_shown");
    const rows = await places();
    await gazer.rest(6);
    await shoot("channels_rested");
    expect((await channels()).map(({ shown }) => shown)).toEqual([
      false,
      ...others.map(({ shown }) => shown),
    ]);
    expect(await places()).toEqual(rows);
  });
});
