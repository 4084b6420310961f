/** Drive the viewer's page as a person does: by its controls. */
import type { Page } from "playwright-core";
import type { Snapshot } from "../../../src/host/snapshot";
import type { Mode } from "../../../src/state/parameters/volumes";

/** Time after which a click is no second one of a double click. */
const APART_MS = 500;

export class ViewerPage {
  private clicked_ms = 0;

  constructor(readonly page: Page) {}

  /** Open an address and wait until the overview is on screen. */
  async open(address: string): Promise<void> {
    await this.page.goto(address);
    await this.page.waitForFunction(() => window.stereocell !== undefined);
    await this.page.evaluate(() => window.stereocell?.ready);
  }

  /** A click that is no second one of a double click, and that no card of a click before it lies over. */
  async clickOnce(x: number, y: number): Promise<void> {
    await this.page.waitForTimeout(Math.max(0, this.clicked_ms + APART_MS - Date.now()));
    const close = this.page.locator('[data-control="tap-close"]');
    if (await close.isVisible()) await close.click();
    await this.page.mouse.click(x, y);
    this.clicked_ms = Date.now();
  }

  /** Wait until nothing loads and the picture shows all of it. */
  async settled(): Promise<void> {
    await this.page.evaluate(() => window.stereocell?.settled());
  }

  /**
   * Ask for a link to the view, and return it once it stands in the address.
   *
   * The address is emptied first. What stood there before, or what the page writes there by itself as it
   * follows the view, can so not be taken for the link.
   */
  async writeLink(): Promise<string> {
    await this.page.evaluate(() => history.replaceState(history.state, "", "#"));
    await this.page.keyboard.press("l");
    await this.page.waitForFunction(() => location.hash.startsWith("#v=1"), null, {
      timeout: 60_000,
    });
    return this.page.url();
  }

  /** Wait until so many frames were drawn, since a busy machine may draw none for a second. */
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

  /** Open a section of the panel, such as `measure`. */
  async unfold(section: string): Promise<void> {
    const opener = this.page.locator(`h2 [data-opener="${section}"]`);
    if ((await opener.count()) === 0) await this.page.locator('h2 [data-opener="more"]').click();
    if ((await opener.getAttribute("aria-expanded")) === "false") await opener.click();
  }

  /** Open a channel's card: its opacity, window and palettes. */
  async openCard(channel: string): Promise<void> {
    const opener = this.page.locator(`[data-channel="${channel}"] [data-opener]`);
    if ((await opener.getAttribute("aria-expanded")) === "false") await opener.click();
  }

  /** Drag a slider to a share of its length. */
  async slide(control: string, share: number): Promise<void> {
    const slider = this.page.locator(`[data-control="${control}"]`);
    const most = Number(await slider.getAttribute("max"));
    await slider.fill(String(Math.round(share * most)));
    await this.settled();
  }

  async show(channel: string, isShown: boolean): Promise<void> {
    if ((await this.part(channel, "shown").count()) === 0) {
      await this.page.locator('[data-control="find-channel"]').fill(channel); // one of many
    }
    await this.part(channel, "shown").setChecked(isShown);
    await this.settled();
  }

  /** Show these channels and no others; at once, since each picture in between takes a while. */
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

  /** Show a channel as its surface, or as its volume in all tiles. */
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

  /** Choose a tile, which then stays chosen; by the map, or by the list where there is none. */
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

  /** Drag from one point of the page to another, and wait until the turn has come to rest. */
  async drag(from: readonly [number, number], to: readonly [number, number]): Promise<void> {
    await this.page.mouse.move(...from);
    await this.page.mouse.down();
    await this.page.mouse.move(...to, { steps: 4 });
    await this.page.mouse.up();
    await this.still();
  }

  /** Turn the specimen by a quarter, so that what was on the left faces the viewer. */
  async turnLeftSideToFront(): Promise<void> {
    const box = await this.page.locator(".stage").boundingBox();
    if (box === null) throw new Error("no stage");
    const y = box.y + box.height / 2;
    const x = box.x + box.width / 4;
    await this.drag([x, y], [x + box.height / 4, y]); // the stage's height is a whole turn
  }

  /** Wait until some of the page's turns pass without a frame: a drag goes on for a while. */
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
    // not by the pointer: in a page of a few pixels a line of text may lie over the button
    await this.page.locator('[data-action="stereo"]').dispatchEvent("click");
    await this.page.waitForFunction(() => window.stereocell?.snapshot().isStereo);
    await this.settled();
    // Two more frames, so that both eyes have been drawn at the pose that holds.
    const frames = await this.page.evaluate(() => window.stereocell?.frames ?? 0);
    await this.page.waitForFunction((n) => (window.stereocell?.frames ?? 0) > n + 1, frames);
  }
}
