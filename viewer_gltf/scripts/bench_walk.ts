/**
 * Measures the load on screen and on the GPU while the gaze moves over all tiles of a bundle, row by row.
 *
 *   npm run build && npm run bench-walk -- BUNDLE [--size 412x780]     CSS pixels
 *
 * The page is controlled by its keys in headless Chromium. Nothing is drawn, which does not change the counts. Prints
 * the triangles on screen, the bytes of volumes on the GPU, and the number of tiles with volumes. There is a row for
 * rest on each tile, and one for the largest numbers during the walk. The exit code is 1 if the gaze has missed a tile.
 */
import { readFile } from "node:fs/promises";
import { join, resolve } from "node:path";
import { parseArgs } from "node:util";
import type { Manifest } from "../src/bundle/generated/bundle";
import type { Snapshot } from "../src/host/snapshot";
import { enter, startChromium } from "../test/support/browser/chromium";
import { Host } from "../test/support/browser/host";
import { ViewerPage } from "../test/support/browser/page";

/** Number of key presses after which a walk that does not end is stopped. */
const MAX_STEPS = 400;

class Walk {
  /** The figures at rest, by the tile under the gaze. */
  private readonly restByTile = new Map<string, Snapshot>();
  private readonly seen: Snapshot[] = [];
  private steps = 0;

  constructor(private readonly viewer: ViewerPage) {}

  /** Opens the page with the front view, near enough for a tile to fill it. */
  async begin(address: string): Promise<void> {
    await this.viewer.open(address);
    await this.viewer.settled();
    this.printFigures("the whole specimen", await this.viewer.snapshot());
    await this.viewer.page.keyboard.press("z");
    for (let i = 0; i < 4; i++) await this.viewer.page.keyboard.press("+");
    await this.viewer.settled();
  }

  /** Walks row by row, alternately to the right and to the left, from one corner to the opposite one. */
  async all(): Promise<void> {
    await this.toTheEnd("Shift+ArrowLeft");
    await this.toTheEnd("Shift+ArrowUp");
    for (let way = "Shift+ArrowRight"; ; ) {
      await this.toTheEnd(way);
      way = way === "Shift+ArrowRight" ? "Shift+ArrowLeft" : "Shift+ArrowRight";
      const before = await this.gazed();
      let isAtEnd = false;
      while (!isAtEnd && (await this.gazed()) === before) {
        isAtEnd = !(await this.step("Shift+ArrowDown"));
      }
      if (isAtEnd) return;
    }
  }

  /** Prints the figures, and returns the exit code: 1 if a tile was missed. */
  report(tiles: readonly string[]): number {
    for (const [tile, snapshot] of this.restByTile) this.printFigures(tile, snapshot);
    const most = (of: (each: Snapshot) => number) => Math.max(...this.seen.map(of));
    process.stdout.write(
      `  the most on the way: ${most(({ triangles }) => triangles)} triangles, ` +
        `${megabytes(most(({ volumeBytes }) => volumeBytes))} MB of volumes\n`,
    );
    const missed = tiles.filter((tile) => !this.restByTile.has(tile));
    if (missed.length > 0) process.stdout.write(`  not gazed at: ${missed.join(", ")}\n`);
    return missed.length > 0 ? 1 : 0;
  }

  private printFigures(where: string, { triangles, volumeBytes, volumes }: Snapshot): void {
    const held = new Set(volumes.map(({ tile }) => tile)).size;
    process.stdout.write(
      `  ${where}: ${triangles} triangles, ${megabytes(volumeBytes)} MB of volumes, tiles: ${held}\n`,
    );
  }

  private async gazed(): Promise<string | null> {
    return (await this.viewer.snapshot()).gazed;
  }

  private async toTheEnd(key: string): Promise<void> {
    while (await this.step(key));
  }

  /** Presses a key; returns false if that has moved nothing. */
  private async step(key: string): Promise<boolean> {
    if (++this.steps > MAX_STEPS)
      throw new Error(`the walk did not end within ${MAX_STEPS} key presses`);
    const before = (await this.viewer.snapshot()).look;
    await this.viewer.page.keyboard.press(key);
    await this.viewer.still();
    const after = await this.viewer.snapshot();
    this.seen.push(after);
    if (after.gazed !== null) this.restByTile.set(after.gazed, after);
    return after.look.target.some((v, i) => Math.abs(v - before.target[i]) > 1e-4);
  }
}

function megabytes(bytes: number): string {
  return (bytes / 1e6).toFixed(1);
}

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: { size: { type: "string", default: "412x780" } },
});
if (positionals.length !== 1) {
  process.stderr.write("usage: npm run bench-walk -- BUNDLE [options]\n");
  process.exit(2);
}
const bundle = resolve(positionals[0]);
const manifest: Manifest = JSON.parse(await readFile(join(bundle, "manifest.json"), "utf8"));
const [width, height] = values.size.split("x").map(Number);

const host = await Host.start({
  "/": new URL("../dist/", import.meta.url).pathname,
  "/bundle/": bundle,
});
const chromium = await startChromium();
const browser = await enter(chromium, { viewport: { width, height }, isBlind: true });
try {
  // Code that tsx compiles uses a helper to name functions, also in functions that run in the page.
  await browser.context.addInitScript("globalThis.__name = (each) => each");
  const page = await browser.context.newPage();
  page.on("pageerror", (error) => process.stderr.write(`page: ${error.message}\n`));
  const walk = new Walk(new ViewerPage(page));
  await walk.begin(`${host.address}/?bundle=bundle/&mode=disc&switch=9`);
  await walk.all();
  process.exitCode = walk.report(manifest.tiles.map(({ id }) => id));
} finally {
  await browser.close();
  await chromium.close();
  await host.stop();
}
