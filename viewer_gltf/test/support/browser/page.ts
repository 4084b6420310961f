/** Operates the viewer's page through its controls, like a user. */
import type { Page } from "playwright-core";
import type { Snapshot } from "../../../src/host/snapshot";
import type { Mode } from "../../../src/state/parameters/volumes";

/** Milliseconds after which a click is not the second one of a double click. */
const APART_MS = 500;

export class ViewerPage {
  private clicked_ms = 0;

  constructor(readonly page: Page) {}

  /** Opens an address and waits until the overview is on screen. */
  async open(address: string): Promise<void> {
    await this.page.goto(address);
    await this.page.waitForFunction(() => window.stereocell !== undefined);
    await this.page.evaluate(() => window.stereocell?.ready);
  }

  /** Clicks once: not as the second click of a double click, and not on the card of an earlier click. */
  async clickOnce(x: number, y: number): Promise<void> {
    await this.page.waitForTimeout(Math.max(0, this.clicked_ms + APART_MS - Date.now()));
    const close = this.page.locator('[data-control="tap-close"]');
    if (await close.isVisible()) await close.click();
    await this.page.mouse.click(x, y);
    this.clicked_ms = Date.now();
  }

  /** Waits until nothing is loading and the view shows everything. */
  async settled(): Promise<void> {
    await this.page.evaluate(() => window.stereocell?.settled());
  }

  /**
   * Requests a link to the view, and returns it once it is in the address.
   *
   * The address is emptied first, so that an older link in it is not mistaken for the new one.
   */
  async writeLink(): Promise<string> {
    await this.page.evaluate(() => history.replaceState(history.state, "", "#"));
    await this.page.keyboard.press("l");
    await this.page.waitForFunction(() => location.hash.startsWith("#v=1"), null, {
      timeout: 60_000,
    });
    return this.page.url();
  }

  /** Waits for a number of frames, since a busy machine may draw none for a second. */
  async drawn(frames: number): Promise<void> {
    await this.page.evaluate(async (count) => {
      for (let i = 0; i < count; i++)
        await new Promise((resolve) => requestAnimationFrame(resolve));
    }, frames);
  }

  async snapshot(): Promise<Snapshot> {
    const snapshot = await this.page.evaluate(() => window.stereocell?.snapshot());
    if (snapshot === undefined) throw new Error("the page has no window.stereocell");
    return snapshot;
  }

  private part(channel: string, name: string) {
    return this.page.locator(`[data-channel="${channel}"] [data-part="${name}"]`);
  }

  /** Opens a section of the panel, for example `measure`. */
  async unfold(section: string): Promise<void> {
    const opener = this.page.locator(`h2 [data-opener="${section}"]`);
    if ((await opener.count()) === 0) await this.page.locator('h2 [data-opener="more"]').click();
    if ((await opener.getAttribute("aria-expanded")) === "false") await opener.click();
  }

  /** Opens the card of a channel, with its opacity, window and palettes. */
  async openCard(channel: string): Promise<void> {
    const opener = this.page.locator(`[data-channel="${channel}"] [data-opener]`);
    if ((await opener.getAttribute("aria-expanded")) === "false") await opener.click();
  }

  /** Moves a slider to a share of its length. */
  async slide(control: string, share: number): Promise<void> {
    const slider = this.page.locator(`[data-control="${control}"]`);
    const most = Number(await slider.getAttribute("max"));
    await slider.fill(String(Math.round(share * most)));
    await this.settled();
  }

  async show(channel: string, isShown: boolean): Promise<void> {
    if ((await this.part(channel, "shown").count()) === 0) {
      // one of many channels
      await this.page.locator('[data-control="find-channel"]').fill(channel);
    }
    await this.part(channel, "shown").setChecked(isShown);
    await this.settled();
  }

  /** Shows these channels and no others, without waiting for frames in between. */
  async showOnly(...channels: readonly string[]): Promise<void> {
    const { state } = await this.snapshot();
    const others = state.channels.filter(({ id, shown }) => shown && !channels.includes(id));
    for (const { id } of others) await this.part(id, "shown").setChecked(false);
    for (const id of channels) await this.part(id, "shown").setChecked(true);
    await this.settled();
  }

  async drawVolume(channel: string, isVolume: boolean): Promise<void> {
    await this.openCard(channel);
    await this.part(channel, "volume").setChecked(isVolume);
    await this.settled();
  }

  /** Shows a channel as its surface, or as its volume in all tiles. */
  async showAs(channel: string, as: "surface" | "volume"): Promise<void> {
    await this.show(channel, true);
    await this.drawVolume(channel, as === "volume");
    if (as === "volume") await this.chooseMode("all");
  }

  async recolor(channel: string, hex: string): Promise<void> {
    await this.part(channel, "color").fill(hex);
    await this.settled();
  }

  async chooseTransferFunction(channel: string, name: string): Promise<void> {
    await this.openCard(channel);
    await this.part(channel, "transfer-function").selectOption(name);
    await this.settled();
  }

  /** Selects a tile, which then stays selected, on the map or in the list. */
  async chooseTile(tile: string): Promise<void> {
    const { selected } = (await this.snapshot()).state;
    const onMap = this.page.locator(`[data-tile-choice="${tile}"]`);
    if ((await onMap.count()) === 0) {
      await this.page.locator("select[data-tile-choice]").selectOption(tile);
    } else if (selected !== tile) await onMap.click();
    await this.settled();
  }

  async chooseMode(mode: Mode): Promise<void> {
    await this.page.locator("select[data-mode]").selectOption(mode);
    await this.settled();
  }

  /** Drags from one point of the page to another, and waits until the view is at rest. */
  async drag(from: readonly [number, number], to: readonly [number, number]): Promise<void> {
    await this.page.mouse.move(...from);
    await this.page.mouse.down();
    await this.page.mouse.move(...to, { steps: 4 });
    await this.page.mouse.up();
    await this.still();
  }

  /** Turns the specimen by a quarter, so that its left side faces the viewer. */
  async turnLeftSideToFront(): Promise<void> {
    const box = await this.page.locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    const y = box.y + box.height / 2;
    const x = box.x + box.width / 4;
    await this.drag([x, y], [x + box.height / 4, y]); // the height of the stage is a whole turn
  }

  /**
   * Waits until several frames of the browser pass without a frame of the viewer, because a drag
   * goes on for a while.
   */
  async still(): Promise<void> {
    await this.settled();
    await this.page.evaluate(async () => {
      const frames = () => window.stereocell?.frames ?? 0;
      for (let idle = 0; idle < 5; ) {
        const before = frames();
        await new Promise((resolve) => requestAnimationFrame(resolve));
        idle = frames() === before ? idle + 1 : 0;
      }
    });
  }

  async enterStereo(): Promise<void> {
    // not by the pointer: on a small page, a text may cover the button
    await this.page.locator('[data-action="stereo"]').dispatchEvent("click");
    await this.page.waitForFunction(() => window.stereocell?.snapshot().isStereo);
    await this.settled();
    // waits for two more frames, so that both eyes have been drawn at the final pose
    const frames = await this.page.evaluate(() => window.stereocell?.frames ?? 0);
    await this.page.waitForFunction((n) => (window.stereocell?.frames ?? 0) > n + 1, frames);
  }
}
