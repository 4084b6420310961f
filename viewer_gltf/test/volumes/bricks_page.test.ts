/**
 * Volumes as bricks from `stereocell serve`. They give the same image as files, arrive piece by
 * piece, and need no network on a second visit. Files replace them where bricks do not suffice.
 * Skipped without the repository's .venv (`make setup`).
 */
import { existsSync } from "node:fs";
import { cp, mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, inject, it } from "vitest";
import type { Shape } from "../../src/bundle/transfer_2d";
import { writeShapes } from "../../src/share/shapes_link";
import { makeShape } from "../../src/state/transfer_shapes";
import type { Browser } from "../support/browser/chromium";
import { Host } from "../support/browser/host";
import { ViewerPage } from "../support/browser/page";
import { difference, type Picture, type Pixel, takePicture } from "../support/browser/picture";
import { STEREOCELL, serve } from "../support/browser/served";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { DIST } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";

const VIEWPORT = { width: 240, height: 160 }; // small, for the software renderer
const QUERY = "?mode=all&quality=high";
/** Shading is off, since it uses the middles of ranges for bricks but levels for files. */
const UNSHADED = "#v=1&depth=0";

/** Counts what a page gets over the websocket, and lists the volumes that it gets as files. */
function count(page: Page) {
  const counted = { bricks: 0, sockets: 0, files: [] as string[] };
  page.on("websocket", (socket) => {
    counted.sockets++;
    socket.on("framereceived", ({ payload }) => {
      if (typeof payload !== "string" && payload[0] === 2) counted.bricks += payload.length;
    });
  });
  page.on("request", (request) => {
    const isLevel = request.headers().range !== undefined;
    if (isLevel && request.url().includes("/volumes/")) counted.files.push(request.url());
  });
  return counted;
}

/**
 * Mean difference, of 255, between the mean values of blocks of 8 x 8 pixels, so that noise does
 * not count.
 */
function apart(a: Picture, b: Picture): number {
  const EDGE = 8;
  let [sum, count] = [0, 0];
  for (let y = 0; y + EDGE <= a.height; y += EDGE) {
    for (let x = 0; x + EDGE <= a.width; x += EDGE) {
      for (let k = 0; k < 3; k++) {
        let difference = 0;
        for (let i = 0; i < EDGE ** 2; i++) {
          const at = [x + (i % EDGE), y + Math.floor(i / EDGE)] as const;
          difference += a.at(...at)[k] - b.at(...at)[k];
        }
        sum += Math.abs(difference) / EDGE ** 2;
        count++;
      }
    }
  }
  return sum / count;
}

describe.skipIf(!existsSync(STEREOCELL))("bricks streamed by view", () => {
  describeInChromium("for a served bundle", () => {
    let out: string;
    let server: Awaited<ReturnType<typeof serve>>;
    let host: Host;
    let browser: Browser;

    beforeAll(async () => {
      out = await mkdtemp(join(tmpdir(), "stereocell-served-"));
      const bundle = join(out, "bundle");
      await cp(inject("fixture"), bundle, { recursive: true });
      await cp(DIST, bundle, { recursive: true });
      server = await serve(out);
      host = await Host.start({ "/": bundle });
      browser = await openBrowser({ viewport: VIEWPORT, pixelRatio: 1, serviceWorkers: "block" });
    });
    afterAll(async () => {
      await browser?.close();
      await host?.stop();
      await server?.stop();
      await rm(out, { recursive: true, force: true });
    });

    async function open(address: string) {
      const page = await browser.context.newPage();
      const counted = count(page);
      const viewer = new ViewerPage(page);
      await viewer.open(address);
      await viewer.settled();
      return { page, viewer, counted };
    }

    it("give the same image as files, and are kept for the next visit", async () => {
      const files = await open(`${host.address}/${QUERY}${UNSHADED}`);
      const expected = await takePicture(files.page);
      expect(files.counted.sockets).toBe(0);
      expect(files.counted.files.length).toBeGreaterThan(0);
      await files.page.close();

      const first = await open(`${server.address}${QUERY}${UNSHADED}`);
      expect(difference(await takePicture(first.page), expected)).toBeLessThan(0.005);
      expect(first.counted.files).toEqual([]);
      expect(first.counted.bricks).toBeGreaterThan(0);
      await first.page.close();

      const second = await open(`${server.address}${QUERY}${UNSHADED}`);
      expect(difference(await takePicture(second.page), expected)).toBeLessThan(0.005);
      expect(second.counted.sockets).toBe(1);
      expect(second.counted.bricks).toBe(0);
      expect(second.counted.files).toEqual([]);
      await second.page.close();
    });

    it.runIf(IS_EXHAUSTIVE)(
      "give the same image as files by value and gradient, marched and path-traced",
      async () => {
        // above the value at which the authored function begins, because bricks leave out smaller
        // values
        const slope: Shape = {
          ...makeShape("rectangle", { value: 0.7, gradient: 0.55 }),
          values: [0.4, 1],
          gradients: [0.1, 1],
        };
        const link = `#v=1&depth=0&c=Balls&only=r0_c1&l=Balls:sown_${writeShapes([slope])}:town&light=many:false`;
        for (const mode of ["all", "traced"]) {
          const drawn = async (address: string) => {
            const { page, viewer, counted } = await open(
              `${address}?mode=${mode}&quality=low&view=front${link}`,
            );
            const samples = async () => (await viewer.snapshot()).traced.samples;
            if (mode === "traced") {
              await expect.poll(samples, { timeout: 90_000 }).toBeGreaterThanOrEqual(3);
            }
            const picture = await takePicture(page);
            const { state, volumes: standIn } = await viewer.snapshot();
            await page.close();
            return { picture, counted, state, standIn };
          };
          const files = await drawn(`${host.address}/`);
          const bricks = await drawn(server.address);
          expect(bricks.state.notices).toEqual([]);
          // the stand-in march for path tracing uses files, since a tile's bricks go to one
          // receiver only
          if (mode === "all") expect(bricks.counted.files).toEqual([]);
          else expect(bricks.standIn.every(({ level }) => level !== null)).toBe(true);
          expect(bricks.standIn.length).toBeGreaterThan(0);
          expect(bricks.counted.sockets).toBeGreaterThan(0);
          const isBlue = ([r, , b]: Pixel) => b > r + 40;
          expect(files.picture.count(isBlue)).toBeGreaterThan(600);
          expect(apart(bricks.picture, files.picture), mode).toBeLessThan(mode === "all" ? 0.5 : 2);
        }
      },
    );

    it("are replaced by files if a function shows voxels that they leave out", async () => {
      const link = "#v=1&l=Balls:w0_0.02,Block:w0_0.02,F_x20_body:w0_0.02";
      const { page, viewer, counted } = await open(`${server.address}${QUERY}${link}`);
      expect(counted.files.length).toBeGreaterThan(0);
      expect((await viewer.snapshot()).state.notices).toEqual([]);
      await page.close();
    });

    it("are replaced by files if the host has no bricks after all", async () => {
      host.headers = { "Stereocell-Bricks": "version=1" };
      const { page, viewer, counted } = await open(`${host.address}/${QUERY}`);
      host.headers = {};
      expect(counted.sockets).toBeGreaterThan(0);
      expect(counted.files.length).toBeGreaterThan(0);
      const { state, volumes } = await viewer.snapshot();
      expect(state.notices).toEqual([]);
      expect(volumes.every(({ level }) => level === 0)).toBe(true);
      await page.close();
    });
  });
});
