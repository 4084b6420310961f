/** Faults between the host and the page: a network that fails and returns, damaged files, empty bundles. */
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { afterEach, beforeEach, expect, it } from "vitest";
import { ViewerPage } from "../support/browser/page";
import { hasColor, isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { swapSurface } from "../support/fixture/swap";
import { Gate } from "../support/offline/gate";

describeInChromium("a fault between host and page", () => {
  const stand = prepareStand({ viewport: { width: 640, height: 360 } });
  let gate: Gate;

  beforeEach(async () => {
    gate = await Gate.before(stand.host.address);
  });

  afterEach(async () => {
    await gate.stop();
  });

  const through = (query = "") => `${gate.address}/app/?bundle=../bundle/${query}`;
  const notices = async () => (await stand.viewer.snapshot()).state.notices;

  /** Returns a file with one byte changed; 40 bytes before the end of a glb lies its mesh. */
  async function changed(path: string): Promise<Buffer> {
    const body = Buffer.from(await readFile(join(stand.bundle, path)));
    body[body.length - 40] ^= 1;
    return body;
  }

  function answer(path: string, body: string | Uint8Array): void {
    stand.host.overrides.set(`/bundle/${path}`, { status: 200, body });
  }

  async function fatalText(body: string | Uint8Array, path = "manifest.json"): Promise<string> {
    stand.host.overrides.set(`/bundle/${path}`, { status: 200, body });
    await stand.viewer.page.goto(`${stand.host.address}/app/?bundle=../bundle/`);
    return (await stand.viewer.page.locator("[data-fatal]").textContent()) ?? "";
  }

  it("a decoder that cannot be loaded is reported for every surface, and nothing hangs", async () => {
    await stand.viewer.page.route("**/meshopt_worker*", (route) => route.abort());
    await stand.open("&mode=off");
    await stand.viewer.settled();
    const report = await notices();
    expect(report.length).toBeGreaterThan(1); // later faults are reported too
    for (const text of report) expect(text).toMatch(/\.glb: the surface can't be read: meshopt: /);
    expect((await stand.viewer.snapshot()).triangles).toBe(0);
  });

  it("a manifest that is cut short is reported as such", async () => {
    const text = JSON.stringify(stand.manifest);
    expect(await fatalText(text.slice(0, text.length / 2))).toContain(
      "manifest.json: found damaged or incomplete JSON (",
    );
  });

  it("a manifest of a newer format is reported with both versions", async () => {
    expect(await fatalText(JSON.stringify({ ...stand.manifest, version: 2 }))).toContain(
      "manifest.json: version is 2, expected 1: open the bundle with the viewer",
    );
  });

  it("a bundle without channels is reported in one line", async () => {
    expect(await fatalText(JSON.stringify({ ...stand.manifest, channels: [] }))).toContain(
      "manifest.json: channels is empty, expected at least one channel: build the bundle again",
    );
  });

  it("a host that can't be reached is reported as such", async () => {
    await stand.viewer.page.route("**/manifest.json", (route) => route.abort());
    await stand.viewer.page.goto(through());
    const fatal = stand.viewer.page.locator("[data-fatal]");
    expect(await fatal.textContent()).toMatch(
      /^.*manifest\.json: the host of .* can't be reached/s,
    );
  });

  it("a volume that is cut short is named, and the surfaces stay", async () => {
    const path = "volumes/r0_c0/Block.ktx2";
    const whole = await readFile(join(stand.bundle, path));
    stand.host.hasRanges = false;
    stand.host.overrides.set(`/bundle/${path}`, { status: 200, body: whole.subarray(0, 100) });
    await stand.open();
    await stand.viewer.drawVolume("Block", true);
    await stand.viewer.chooseMode("all");
    expect((await notices()).join()).toContain(
      `${path}: found 100 bytes, expected ${whole.length}: upload the file again`,
    );
    // the volume of the other tile
    expect((await stand.viewer.snapshot()).volumes.length).toBeGreaterThan(0);
    const picture = await takePicture(stand.viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
  });

  it.runIf(IS_EXHAUSTIVE)("a volume with wrong bytes is named", async () => {
    const path = "volumes/r0_c0/Block.ktx2";
    const body = Buffer.from(await readFile(join(stand.bundle, path)));
    body[body.length - 1] ^= 1;
    stand.host.hasRanges = false;
    stand.host.overrides.set(`/bundle/${path}`, { status: 200, body });
    await stand.open();
    await stand.viewer.drawVolume("Block", true);
    await stand.viewer.chooseMode("all");
    expect((await notices()).join()).toMatch(new RegExp(`${path}: expected SHA-256 .*, found`));
  });

  it("a level with wrong bytes is named once, and the surfaces stay", async () => {
    const path = "volumes/r0_c0/Block.ktx2";
    const statuses: number[] = [];
    await stand.viewer.page.route(`**/${path}`, async (route) => {
      const response = await route.fetch();
      const body = await response.body();
      body[body.length >> 1] ^= 1;
      statuses.push(response.status());
      await route.fulfill({ response, body });
    });
    await stand.open("&mode=off");
    await stand.viewer.settled();
    const { triangles } = await stand.viewer.snapshot();
    expect(triangles).toBeGreaterThan(0);
    await stand.viewer.drawVolume("Block", true);
    await stand.viewer.chooseMode("all");
    expect(statuses).toEqual([206, 206]); // a range, requested a second time without caches
    expect(await notices()).toEqual([
      expect.stringMatching(
        new RegExp(`^${path}: level \\d+: expected SHA-256 [0-9a-f]{64}, found [0-9a-f]{64}$`),
      ),
    ]);
    // the volume of the other tile
    expect((await stand.viewer.snapshot()).volumes.length).toBeGreaterThan(0);
    const picture = await takePicture(stand.viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    await stand.viewer.chooseMode("off");
    expect((await stand.viewer.snapshot()).triangles).toBe(triangles);
  });

  it("a surface with a wrong byte is named, and the others stay", async () => {
    const path = "channels/Balls/r0_c1/lod2.glb";
    answer(path, await changed(path));
    await stand.open("&mode=off");
    await stand.viewer.show("F_x20_body", false);
    expect(await notices()).toEqual([
      expect.stringMatching(
        new RegExp(`^${path}: expected sha-256-128 [\\w-]{22}, found [\\w-]{22}$`),
      ),
    ]);
    expect((await stand.viewer.snapshot()).triangles).toBeGreaterThan(0);
  });

  it.runIf(IS_EXHAUSTIVE)(
    "a finer surface with a wrong byte is named, and the coarser one stays",
    async () => {
      await stand.open("&mode=off");
      await stand.viewer.show("F_x20_body", false);
      const whole = (await stand.viewer.snapshot()).triangles;
      const path = "channels/Balls/r0_c1/lod1.glb";
      answer(path, await changed(path));
      await stand.open("&mode=off");
      await stand.viewer.show("F_x20_body", false);
      expect(await notices()).toEqual([expect.stringContaining(`${path}: expected sha-256-128 `)]);
      expect((await stand.viewer.snapshot()).triangles).toBeLessThan(whole);
      const picture = await takePicture(stand.viewer.page);
      const places = picture.where(hasColor([0.05, 0.4, 1]));
      expect(places.filter(([x]) => x > picture.width / 2).length).toBeGreaterThan(100);
    },
  );

  it("a surface that is not a valid glTF is named, and the others stay", async () => {
    const path = "channels/Balls/r0_c1/lod2.glb";
    const body = Buffer.from(await readFile(join(stand.bundle, path)));
    body.fill(0x7b, 20, 40); // the start of the JSON chunk
    const files = await swapSurface(stand.bundle, "Balls", "r0_c1/lod2.glb", body);
    for (const [file, content] of files) answer(file, content);
    await stand.open();
    await stand.viewer.settled();
    expect((await notices()).join()).toContain(`${path}: the surface can't be read`);
    expect((await stand.viewer.snapshot()).triangles).toBeGreaterThan(0);
  });

  it.runIf(IS_EXHAUSTIVE)(
    "a network that fails during loading and returns leaves no trace",
    async () => {
      const viewer = new ViewerPage(stand.viewer.page);
      await viewer.open(through("&mode=off"));
      await viewer.settled();
      gate.shut();
      const shown = viewer.drawVolume("Block", true).then(() => viewer.chooseMode("all"));
      await new Promise((resolve) => setTimeout(resolve, 700)); // a first attempt has failed
      gate.open();
      await shown;
      await viewer.settled();
      expect(await notices()).toEqual([]);
      expect((await viewer.snapshot()).volumes.length).toBeGreaterThan(0);
    },
  );

  it("a network that stays away is reported, and loaded parts stay on screen", async () => {
    const viewer = new ViewerPage(stand.viewer.page);
    await viewer.open(through("&mode=off"));
    await viewer.settled();
    const { triangles } = await viewer.snapshot();
    gate.shut();
    await viewer.drawVolume("Block", true);
    await viewer.chooseMode("all");
    expect((await notices()).join()).toMatch(/can't be reached/);
    expect((await viewer.snapshot()).triangles).toBeGreaterThan(0);
    await viewer.chooseMode("off");
    expect((await viewer.snapshot()).triangles).toBe(triangles);
    const picture = await takePicture(viewer.page);
    expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
  });

  it("a bundle without faults leaves no warning in the console", async () => {
    const warnings: string[] = [];
    stand.viewer.page.on("console", (message) => {
      if (["warning", "error"].includes(message.type())) warnings.push(message.text());
    });
    await stand.open("&mode=all");
    await stand.viewer.settled();
    // the driver forbids warnings, and software draws slowly
    expect(warnings.filter((text) => !/Service Worker|GL Driver/.test(text))).toEqual([]);
  });

  /** Switches volumes on and moves closer, without a network, until all attempts have failed. */
  async function starve(viewer: ViewerPage, notice: RegExp): Promise<number> {
    for (let i = 0; i < 10; i++) await viewer.page.keyboard.press("+");
    await viewer.settled();
    const { triangles } = await viewer.snapshot();
    await viewer.chooseMode("all");
    await expect.poll(notices).toEqual([expect.stringMatching(notice)]);
    expect((await viewer.snapshot()).volumes).toEqual([]);
    return triangles;
  }

  async function expectAll(viewer: ViewerPage, starved: number): Promise<void> {
    await expect.poll(notices).toEqual([]);
    await viewer.settled();
    const { volumes } = await viewer.snapshot();
    expect(volumes.length).toBeGreaterThan(0);
    expect(volumes.filter(({ level }) => level === null)).toEqual([]);
    await viewer.chooseMode("off");
    expect((await viewer.snapshot()).triangles).toBeGreaterThan(starved);
    expect(await viewer.page.locator("[data-action=retry]").count()).toBe(0);
    expect(await notices()).toEqual([]);
  }

  /** Shortens the pauses between attempts. */
  const hurry = () =>
    stand.viewer.page.addInitScript(() => {
      const real = window.setTimeout.bind(window);
      const hurried = (job: TimerHandler, pause_ms?: number) =>
        real(job, Math.min(pause_ms ?? 0, 50));
      window.setTimeout = hurried as typeof setTimeout;
    });

  it.runIf(IS_EXHAUSTIVE)(
    "an outage longer than all attempts leaves no trace once the device has a network",
    async () => {
      await hurry();
      const viewer = new ViewerPage(stand.viewer.page);
      const context = viewer.page.context();
      await viewer.open(through("&mode=off"));
      await viewer.settled();
      await context.setOffline(true);
      const starved = await starve(viewer, /^This device is offline/);
      await context.setOffline(false);
      await expectAll(viewer, starved);
    },
  );

  it("a host that was unreachable for long sends everything after another attempt", async () => {
    await hurry();
    const viewer = new ViewerPage(stand.viewer.page);
    await viewer.page.route("**/Balls/tileset.json", (route) => route.abort());
    await viewer.open(through("&mode=off"));
    await viewer.settled();
    await viewer.page.unroute("**/Balls/tileset.json");
    gate.shut();
    const starved = await starve(
      viewer,
      /^The host .* can't be reached, or forbids this page: some files/,
    );
    gate.open();
    await viewer.page.locator("[data-action=retry]").click();
    await expectAll(viewer, starved);
  });

  it("a connection that breaks is tried again", async () => {
    const path = "/bundle/channels/Balls/r0_c1/lod2.glb";
    let broken = 0;
    await stand.viewer.page.route(`**${path}`, async (route) => {
      if (broken++ > 0) return route.continue();
      return route.abort("connectionreset");
    });
    await stand.open();
    await stand.viewer.settled();
    expect(await notices()).toEqual([]);
    expect(broken).toBe(2);
  });
});
