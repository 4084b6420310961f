/**
 * Measures frames per second of a bundle in headless Chromium, by the viewer's own benchmark (`?bench`).
 *
 *   npm run build && npm run bench-fps -- OUT BUNDLE [BUNDLE ...]
 *     --size 640x400   CSS pixels
 *     --flight 4       length of each run, s
 *
 * Writes OUT/<bundle's name>.json and .png.
 */
import { mkdir, writeFile } from "node:fs/promises";
import { basename, dirname, join, resolve } from "node:path";
import { parseArgs } from "node:util";
import type { Report } from "../src/bench/report";
import { enter, startChromium } from "../test/support/browser/chromium";
import { Host } from "../test/support/browser/host";

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    size: { type: "string", default: "640x400" },
    flight: { type: "string", default: "4" },
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
  for (const bundle of bundles) await measure(resolve(bundle), nameOf(resolve(bundle)));
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
