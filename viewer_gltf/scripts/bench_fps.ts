/**
 * This script measures a bundle in headless Chromium. The viewer's own benchmark (`?bench`) counts frames per second,
 * and split_frames.ts finds the CPU time of a split-screen frame.
 *
 *   npm run build && npm run bench-fps -- OUT BUNDLE [BUNDLE ...]
 *     --size 640x400   CSS pixels of the flights
 *     --flight 4       length of each run, s; 0 leaves the flights out
 *     --beside DIST    also measures the split screen of another checkout's built viewer, alternately
 *
 * To compare with an older commit, make a worktree of it, run `npm ci && npm run build` in its viewer_gltf, and give
 * the folder viewer_gltf/dist there as DIST.
 *
 * Writes OUT/<bundle's name>.json and .png of the flights.
 */
import { mkdir, writeFile } from "node:fs/promises";
import { basename, dirname, join, resolve } from "node:path";
import { parseArgs } from "node:util";
import type { Report } from "../src/bench/report";
import { enter, startChromium } from "../test/support/browser/chromium";
import { Host } from "../test/support/browser/host";
import { measureSplitFrames } from "./split_frames";

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    size: { type: "string", default: "640x400" },
    flight: { type: "string", default: "4" },
    beside: { type: "string" },
  },
});
const [out, ...bundles] = positionals;
if (out === undefined || bundles.length === 0) {
  process.stderr.write("usage: npm run bench-fps -- OUT BUNDLE [BUNDLE ...] [options]\n");
  process.exit(2);
}
const [width, height] = values.size.split("x").map(Number);
const dist = new URL("../dist/", import.meta.url).pathname;
await mkdir(out, { recursive: true });
const chromium = await startChromium();
try {
  for (const bundle of bundles.map((each) => resolve(each))) {
    if (Number(values.flight) > 0) await measure(bundle, nameOf(bundle));
    await printSplitFrames(bundle, nameOf(bundle));
  }
} finally {
  await chromium.close();
}

/** Returns the name of a bundle's folder, or of the build that contains it. */
function nameOf(bundle: string): string {
  return basename(bundle) === "bundle" ? basename(dirname(bundle)) : basename(bundle);
}

async function measure(bundle: string, name: string): Promise<void> {
  const host = await Host.start({ "/": dist, "/bundle/": bundle });
  const browser = await enter(chromium, { viewport: { width, height } });
  try {
    const page = await browser.context.newPage();
    page.on("pageerror", (error) => process.stderr.write(`page: ${error.message}\n`));
    await page.goto(`${host.address}/?bundle=bundle/&bench=${values.flight}`);
    await page.locator("[data-bench=split]").click();
    const canvas = page.locator(".bench canvas");
    await canvas.waitFor({ timeout: 0 });
    const found = await page.evaluate(() => window.stereocell?.bench ?? null);
    const report = found as Report | null;
    if (report === null) throw new Error(`${bundle}: the page has no report`);
    const file = join(out, name);
    await writeFile(`${file}.json`, `${JSON.stringify(report, null, 2)}\n`);
    const picture = await canvas.evaluate((each) => (each as HTMLCanvasElement).toDataURL());
    await writeFile(`${file}.png`, Buffer.from(picture.split(",")[1], "base64"));
    for (const { mode, eyes, edge, fps, p95_ms, drawCalls } of report.runs) {
      process.stdout.write(
        `${name}: ${mode}, ${eyes}${edge === null ? "" : `, ${edge} voxels`}: ${fps} frames/s, ` +
          `95 % within ${p95_ms} ms, ${drawCalls} draw calls\n`,
      );
    }
  } finally {
    await browser.close();
    await host.stop();
  }
}

async function printSplitFrames(bundle: string, name: string): Promise<void> {
  const viewers = [dist, ...(values.beside === undefined ? [] : [resolve(values.beside)])];
  for await (const frames of measureSplitFrames(chromium, bundle, viewers)) {
    for (const { mode, viewer, cpu_ms } of frames) {
      const ratio = median(cpu_ms.map((each, i) => frames[0].cpu_ms[i] / each));
      const [low, high] = [Math.min(...cpu_ms), Math.max(...cpu_ms)].map(Math.round);
      process.stdout.write(
        `${name}: ${mode}, split screen of 1600 x 720: ${Math.round(median(cpu_ms))} ms of CPU a frame (${low} to ${high})` +
          `${viewer === dist ? "" : ` by ${viewer}; this checkout takes ${ratio.toFixed(2)} of it`}\n`,
      );
    }
  }
}

/** Returns the middle value, or the upper one of the two in the middle. */
function median(values: readonly number[]): number {
  return [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
}
