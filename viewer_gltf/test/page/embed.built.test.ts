/** The viewer in a frame of another origin, with the example of docs/embed.md. */
import { readFile } from "node:fs/promises";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { afterAll, beforeAll, expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const DOCS = new URL("../../../docs/embed.md", import.meta.url);

describeInChromium("the viewer in another page", () => {
  const stand = prepareStand({ viewport: { width: 800, height: 600 }, isBlind: true });
  let server: Server;
  let holder: string;
  let example: string;

  beforeAll(async () => {
    const [, found] = /```html\n([\s\S]*?)```/.exec(await readFile(DOCS, "utf8")) ?? [];
    if (found === undefined) throw new Error("no example in docs/embed.md");
    expect(found.split("\n").length).toBeLessThanOrEqual(32);
    // a reader of the docs replaces only the address of the bundle
    example = found
      .replace("https://host.example/specimen/", `${stand.host.address}/app/`)
      .replace("?panel=off", "?bundle=/bundle/&panel=off");
    server = createServer((_, response) => {
      response.setHeader("Content-Type", "text/html");
      response.end(example);
    }).listen(0, "127.0.0.1");
    await new Promise((resolve) => server.once("listening", resolve));
    holder = `http://127.0.0.1:${(server.address() as AddressInfo).port}`;
  });

  afterAll(() => {
    server?.close();
  });

  async function open() {
    const { page } = stand.viewer;
    await page.goto(holder);
    const status = page.locator("#status");
    await expect.poll(() => status.textContent()).toMatch(/^Shown: F_x20_body/);
    return { page, status, frame: page.frameLocator("#viewer") };
  }

  it("is notified of changes and makes changes, without a panel", async () => {
    const { page, status, frame } = await open();
    expect(await frame.locator(".panel").isVisible()).toBe(false);
    expect(await frame.locator(".stage canvas").isVisible()).toBe(true);
    await page.locator("#toggle").click();
    await expect.poll(() => status.textContent()).not.toMatch(/F_x20_body/);
    await page.locator("#toggle").click();
    await expect.poll(() => status.textContent()).toMatch(/F_x20_body/);
  });

  it("rejects invalid requests, and ignores other pages", async () => {
    const { page, status } = await open();
    const send = (state: unknown) =>
      page.evaluate((asked) => {
        const frame = document.querySelector<HTMLIFrameElement>("#viewer");
        frame?.contentWindow?.postMessage({ target: "stereocell", state: asked }, "*");
      }, state);
    await send({ channels: { Balls: { opacity: 7 } } });
    await expect
      .poll(() => status.textContent())
      .toBe("channels.Balls.opacity is 7, expected 0 to 1");
    // the frame itself has another origin than the page that may send requests
    const inner = page.frames().find((each) => each.url().includes("embed="));
    await inner?.evaluate(() =>
      postMessage(
        { target: "stereocell", state: { channels: { Balls: { visible: false } } } },
        "*",
      ),
    );
    await page.waitForTimeout(500);
    const shown = await inner?.evaluate(
      () => window.stereocell?.snapshot().state.channels.find(({ id }) => id === "Balls")?.shown,
    );
    expect(shown).toBe(true);
  });

  it("leaves the wheel to the page until the user has clicked into the frame", async () => {
    const { page } = await open();
    const inner = page.frames().find((each) => each.url().includes("embed="));
    const distance = () =>
      inner?.evaluate(() => Math.hypot(...(window.stereocell?.snapshot().look.position ?? [])));
    await page.locator("#toggle").click(); // the page keeps the keyboard focus
    await page.evaluate(() => {
      document.body.style.minHeight = "3000px";
    });
    expect(await inner?.locator('[data-overlay="hint"]').textContent()).toContain("Ctrl and wheel");
    const before = await distance();
    const scrolled = () => page.evaluate(() => scrollY);
    await page.mouse.move(300, 300);
    await page.mouse.wheel(0, 30);
    await expect.poll(scrolled).toBe(30);
    expect(await distance()).toBe(before);
    // a pinch on a trackpad is sent as a wheel event with Ctrl: it zooms the specimen, and not the
    // page
    await page.keyboard.down("Control");
    await page.mouse.wheel(0, -300);
    await page.keyboard.up("Control");
    await expect.poll(distance).not.toBe(before);
    const pinched = await distance();
    expect(await scrolled()).toBe(30);
    expect(await page.evaluate(() => visualViewport?.scale)).toBe(1);
    await page.mouse.click(20, 400); // a corner of the frame beside the specimen
    await page.mouse.move(300, 300);
    await page.mouse.wheel(0, -300);
    await expect.poll(distance).not.toBe(pinched);
    expect(await scrolled()).toBe(30);
  });
});
