/** The first half minute: the page before its code is loaded, the opening view, its rotation, its hint. */
import { expect, it } from "vitest";
import { addClock, holdFrames, tick } from "../support/browser/clock";
import { difference, isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, prepareStand } from "../support/browser/stand";
import { sweep } from "../support/exhaustive";

describeInChromium("the opening", () => {
  const stand = prepareStand({ bundle: DEMO_BUNDLE, viewport: { width: 560, height: 360 } });
  const page = () => stand.viewer.page;
  const address = (query = "") => `${stand.host.address}/app/?bundle=../bundle/${query}`;

  /** Share of the view's height without texts and buttons over it. */
  const freeShare = () =>
    page()
      .locator(".stage")
      .evaluate((stage) => {
        const style = getComputedStyle(stage);
        const over = ["--over-top", "--over-bottom"].map((edge) =>
          Number.parseFloat(style.getPropertyValue(edge)),
        );
        return 1 - (over[0] + over[1]) / stage.clientHeight;
      });

  it("counts the bytes of the code while it loads, reports a failure, and tries again", async () => {
    const devtools = await page().context().newCDPSession(page());
    await devtools.send("Network.enable");
    const slow = { offline: false, latency: 0, uploadThroughput: -1 };
    await devtools.send("Network.emulateNetworkConditions", { ...slow, downloadThroughput: 1e5 });
    await page().goto(address(), { waitUntil: "commit" });
    const words = page().locator("[data-boot] p");
    const counted = /^Loading the viewer: (\d+) kB of (\d+) kB$/;
    await expect.poll(() => words.textContent()).toMatch(counted);
    const [, first, all] = counted.exec((await words.textContent()) ?? "") ?? [];
    expect(Number(all)).toBeGreaterThan(100);
    const later = async () => Number(counted.exec((await words.textContent()) ?? "")?.[1]);
    await expect.poll(later).toBeGreaterThan(Number(first));
    await devtools.send("Network.emulateNetworkConditions", { ...slow, downloadThroughput: -1 });
    await devtools.detach();

    await page().route(/viewer-.*\.js\.gz$/, (route) => route.fulfill({ status: 404 }), {
      times: 1,
    });
    await page().goto(address());
    await expect.poll(() => words.textContent()).toMatch(/could not be loaded: .*404/);
    await words.locator("button").click();
    await page().waitForFunction(() => window.stereocell !== undefined);
    await page().evaluate(() => window.stereocell?.ready);
  });

  it("fills the view, shows volumes, and turns until the first touch", async () => {
    await page().emulateMedia({ reducedMotion: "no-preference" });
    await stand.viewer.open(address("&quality=low"));
    const volumes = async () => (await stand.viewer.snapshot()).volumes.length;
    await expect.poll(volumes).toBeGreaterThan(0);
    await expect
      .poll(async () => (await stand.viewer.snapshot()).discRadius_deg)
      .toBeGreaterThan(1);
    const hint = page().locator('[data-overlay="hint"]');
    expect(await hint.textContent()).toBe("drag to turn, wheel to zoom, move closer for volumes");
    const frames = () => page().evaluate(() => window.stereocell?.frames ?? 0);
    const before = await frames();
    await expect.poll(frames).toBeGreaterThan(before + 3);

    const stage = await page().locator(".stage").boundingBox();
    if (stage === null) throw new Error("no stage");
    await page().mouse.click(stage.x + 4, stage.y + 4); // a place without any structure
    await stand.viewer.still();
    await expect.poll(() => hint.evaluate((found) => getComputedStyle(found).opacity)).toBe("0");
    await page().emulateMedia({ reducedMotion: "reduce" });
  });

  it("is framed on the visible structures, as surfaces and as volumes", async () => {
    // a channel without a surface may fill the specimen, so the whole specimen is framed then
    const withSurface = stand.manifest.channels.filter(({ tileset }) => tileset !== null);
    const isWhole = withSurface.length === stand.manifest.channels.length;
    const link = isWhole ? "" : `#v=1&c=${withSurface.map(({ id }) => id)}`;
    // volumes are framed by bricks of 8 voxels; the tiles of the fixture are too small for a tight
    // frame
    const modes = DEMO_BUNDLE === undefined ? ["disc"] : ["disc", "traced"];
    // the filled part of the view depends on the rotation, so the opening view is measured
    for (const mode of modes) {
      await stand.viewer.open(address(`&quality=low&mode=${mode}${link}`));
      await stand.viewer.settled();
      const picture = await takePicture(page());
      const inside: [number, number][] = [];
      for (let y = 0; y < picture.height; y += 2) {
        for (let x = 0; x < picture.width; x += 2) {
          if (!isBackground(picture.at(x, y))) inside.push([x, y]);
        }
      }
      const extent = (axis: 0 | 1, size: number) => {
        const all = inside.map((at) => at[axis]);
        return (Math.max(...all) - Math.min(...all)) / size;
      };
      const height = picture.height * (await freeShare());
      const filled = Math.max(extent(0, picture.width), extent(1, height));
      expect(filled, mode).toBeGreaterThan(0.85);
      expect(filled, mode).toBeLessThan(0.98);
    }
  });

  it("has its hint beside the other marks, also in small windows", async () => {
    const usual = page().viewportSize() ?? { width: 560, height: 360 };
    const sizes = [
      [320, 240],
      [640, 240],
      [568, 320],
      [320, 568],
    ];
    for (const [width, height] of sweep(sizes, ([width]) => width === 320)) {
      await page().setViewportSize({ width, height });
      await stand.viewer.open(address("&quality=low&mode=disc"));
      const over = await page().evaluate(() => {
        const boxOf = (found: Element) => found.getBoundingClientRect();
        const [hint] = [...document.querySelectorAll('[data-overlay="hint"]')].map(boxOf);
        const others = ".way:not([hidden]), .scale-bar, .orientation-mark, .panel";
        return [...document.querySelectorAll(others)]
          .filter((other) => {
            const { left, right, top, bottom } = boxOf(other);
            const isAside = left >= hint.right || right <= hint.left;
            return !isAside && top < hint.bottom && bottom > hint.top;
          })
          .map((other) => other.getAttribute("class"))
          .concat(hint.bottom - hint.top > 56 ? [`${hint.bottom - hint.top} px high`] : []);
      });
      expect(over, `${width} x ${height}`).toEqual([]);
    }
    await page().setViewportSize(usual);
  });

  it("stops turning before volumes look like blocks, if frames are late", async () => {
    await page().emulateMedia({ reducedMotion: "no-preference" });
    await addClock(page());
    await stand.viewer.open(address("&quality=auto"));
    await holdFrames(page());
    const isLoading = async () => {
      await tick(page(), 0); // files arrive in real time, while the clock of the test stands still
      return (await stand.viewer.snapshot()).isLoading;
    };
    await expect.poll(isLoading).toBe(false);
    const settings = async () => (await stand.viewer.snapshot()).settings;
    const turned = [await takePicture(page())];
    await tick(page(), 400, 3);
    turned.push(await takePicture(page()));
    expect(difference(turned[0], turned[1])).toBeGreaterThan(0.01);
    await tick(page(), 400, 40);
    // a turn would go on for ever; the frame at rest follows those before it, and gets clearer
    const best = { steps: 100, resolution: 1, discShare: 1, errorFactor: 1 };
    const atRest = async () => {
      const before = await takePicture(page());
      await tick(page(), 400, 3);
      const isStill = difference(before, await takePicture(page())) < 0.01;
      return { isStill, ...(await settings()) };
    };
    await expect.poll(atRest).toEqual({ isStill: true, ...best });
    await page().emulateMedia({ reducedMotion: "reduce" });
  });

  it("does not turn if the user prefers less motion, or if the address names the view", async () => {
    for (const query of ["&quality=low", "&quality=low&view=top"]) {
      await page().emulateMedia({
        reducedMotion: query.includes("view") ? "no-preference" : "reduce",
      });
      await stand.viewer.open(address(query));
      await stand.viewer.still(); // never resolves while the view turns
    }
    // the hint mentions volumes only in modes that show them when near
    const hint = page().locator('[data-overlay="hint"]');
    await stand.viewer.chooseMode("off");
    expect(await hint.textContent()).toBe("drag to turn, wheel to zoom");
    await page().emulateMedia({ reducedMotion: "reduce" });
  });
});
