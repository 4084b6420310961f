/** Opens the harness of the hands in Chromium, and operates it. */
import type { Page } from "playwright-core";
import { afterAll, beforeAll, beforeEach } from "vitest";
import { bundled } from "../browser/bundled";
import type { Browser } from "../browser/chromium";
import { openBrowser } from "../browser/shared_browser";

const ADDRESS = "http://localhost/hands";
const PAGE = `<!doctype html><style>
  body { margin: 0; background: #000 }
  #stage { width: 100vw; height: 100vh }
  [data-webxr_runtime] canvas { width: 100% !important; height: 100% !important }
</style><body><div id="stage"></div>`;

const MOST_PAGES = 12;
/** Milliseconds after which a press is not the second one of a double press, which is ignored. */
const PRESS_APART_MS = 450;

export type At = readonly [number, number, number];
export type Side = "left" | "right";

export class HandsStand {
  constructor(readonly page: Page) {}

  status = () => this.page.evaluate(() => window.hands.status());
  chosen = () => this.page.evaluate(() => window.hands.chosen);
  actions = () => this.page.evaluate(() => window.hands.actions);
  step = (times_s: readonly number[]) =>
    this.page.evaluate((times) => window.hands.step(times), times_s);
  lookAt = (at: At) => this.page.evaluate((to) => window.hands.lookAt(to), at);
  point = (side: Side, from: At, at: At) =>
    this.page.evaluate(([s, f, a]) => window.hands.point(s, f, a), [side, from, at] as const);
  connect = (side: Side, isConnected: boolean) =>
    this.page.evaluate(([s, is]) => window.hands.connect(s, is), [side, isConnected] as const);
  button = (side: Side, id: "trigger" | "squeeze", value: number) =>
    this.page.evaluate(([s, i, v]) => window.hands.button(s, i, v), [side, id, value] as const);
  tileAt = (id: string) => this.page.evaluate((tile) => window.hands.tileAt(tile), id);
  controlAt = (id: string, across?: number, down?: number) =>
    this.page.evaluate(([i, a, d]) => window.hands.controlAt(i, a, d), [id, across, down] as const);
  tap = () => this.page.evaluate(() => window.hands.tap());

  /** Lets seconds pass, in frames of 0.05 s. */
  async wait(seconds: number): Promise<void> {
    const frames = Math.floor(seconds * 20 + 1e-9);
    await this.step(Array.from({ length: frames }, () => 0.05));
  }

  async press(side: Side): Promise<void> {
    await this.button(side, "trigger", 1);
    await this.button(side, "trigger", 0);
  }

  /** Disconnects both controllers, as in a Cardboard. */
  async gazeOnly(): Promise<void> {
    await this.connect("left", false);
    await this.connect("right", false);
  }

  async openPanel(): Promise<void> {
    await this.tapOn("opener");
  }

  /** Looks at a control of the panel or the bar, and presses the button. */
  async tapOn(id: string): Promise<void> {
    await this.lookAt(await this.controlAt(id));
    await this.tap();
  }

  /** Goes from any page of the open panel to a section, by the bar and the list of sections. */
  async openSection(section: string): Promise<void> {
    const regions = async () => (await this.status()).regions;
    while ((await regions()).includes("up")) {
      await this.tapOn("up");
      await this.page.waitForTimeout(PRESS_APART_MS);
    }
    await this.reach(`tab=${section}`);
    await this.tapOn(`tab=${section}`);
  }

  /** Turns to the page of the list or section that has a control. */
  async reach(id: string): Promise<void> {
    for (let page = 0; page < MOST_PAGES; page++) {
      if ((await this.status()).regions.includes(id)) return;
      await this.tapOn("more");
    }
    throw new Error(`no page has ${id}`);
  }

  /** Goes from the list of channels to the page of one of them, by its swatch. */
  async openChannel(channel: string): Promise<void> {
    await this.tapOn(`${channel}/open`);
    await this.tapOn(`${channel}/more`);
  }
}

export function prepareHands(
  viewport = { width: 640, height: 320 },
  pixelRatio?: number,
): () => HandsStand {
  let browser: Browser;
  let script: string;
  let stand: HandsStand;

  beforeAll(async () => {
    script = await bundled(new URL("./harness.ts", import.meta.url));
    browser = await openBrowser({ viewport, pixelRatio });
    const page = await browser.context.newPage();
    await page.route(ADDRESS, (route) => route.fulfill({ body: PAGE, contentType: "text/html" }));
    stand = new HandsStand(page);
  });
  beforeEach(async () => {
    await stand.page.goto(ADDRESS);
    await stand.page.addScriptTag({ content: script });
    await stand.page.evaluate(() => window.hands.start());
  });
  afterAll(() => browser?.close());
  return () => stand;
}
