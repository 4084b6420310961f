/**
 * Draws a picture of a bundle with headless Chromium.
 *
 *   npm run build && npm run screenshot -- BUNDLE OUT.png [options]
 *     --size 1280x720        CSS pixels
 *     --mode MODE            where volumes are drawn: disc, tile, all, stage, off
 *     --switch 9             switch distance, metres of the room
 *     --disc 12              radius of the disc, degrees
 *     --tile r0_c0           the tile of --mode tile
 *     --surfaces A,B         channel ids that stay surfaces
 *     --only A,B             show these channels only
 *     --transfer NAME        transfer function of the volumes
 *     --stereo               what an emulated headset shows, both eyes
 *     --phone                portrait, with touch
 *     --page                 the bundle's own index.html instead of dist/
 */
import { parseArgs } from "node:util";
import { addHeadset, enter, startChromium } from "../test/support/browser/chromium";
import { Host } from "../test/support/browser/host";
import { ViewerPage } from "../test/support/browser/page";

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    size: { type: "string", default: "1280x720" },
    mode: { type: "string" },
    switch: { type: "string" },
    disc: { type: "string" },
    surfaces: { type: "string" },
    tile: { type: "string" },
    only: { type: "string" },
    transfer: { type: "string" },
    stereo: { type: "boolean", default: false },
    phone: { type: "boolean", default: false },
    page: { type: "boolean", default: false },
  },
});
const [bundle, out] = positionals;
if (bundle === undefined || out === undefined) {
  process.stderr.write("usage: npm run screenshot -- BUNDLE OUT.png [options]\n");
  process.exit(2);
}

const [width, height] = values.phone ? [390, 780] : values.size.split("x").map(Number);
const dist = new URL("../dist/", import.meta.url).pathname;
const host = await Host.start({ "/": values.page ? bundle : dist, "/bundle/": bundle });
const chromium = await startChromium();
const browser = await enter(chromium, {
  viewport: { width, height },
  hasTouch: values.phone,
});
try {
  const page = await browser.context.newPage();
  page.on("pageerror", (error) => process.stderr.write(`page: ${error.message}\n`));
  page.on("console", (message) => {
    if (message.type() === "error") process.stderr.write(`console: ${message.text()}\n`);
  });
  if (values.stereo) await addHeadset(page);
  const viewer = new ViewerPage(page);
  const started = performance.now();
  const settings = (["mode", "switch", "disc"] as const).flatMap((name) =>
    values[name] === undefined ? [] : [`${name}=${values[name]}`],
  );
  const query = [...(values.page ? [] : ["bundle=bundle/"]), ...settings].join("&");
  await viewer.open(`${host.address}/?${query}`);
  const overview_s = (performance.now() - started) / 1000;
  const { state } = await viewer.snapshot();
  const only = values.only?.split(",");
  const shown = state.channels.filter(({ id, shown }) => only?.includes(id) ?? shown);
  for (const channel of state.channels) {
    const isShown = shown.includes(channel);
    if (isShown !== channel.shown) await viewer.show(channel.id, isShown);
  }
  for (const id of values.surfaces?.split(",") ?? []) await viewer.drawVolume(id, false);
  if (values.transfer !== undefined) {
    for (const { id } of shown) await viewer.chooseTransferFunction(id, values.transfer);
  }
  if (values.tile !== undefined) await viewer.chooseTile(values.tile);
  if (values.stereo) await viewer.enterStereo();
  else await viewer.settled();
  const { triangles, volumes } = await viewer.snapshot();
  await page.screenshot({ path: out });
  process.stdout.write(
    `${out}: overview after ${overview_s.toFixed(1)} s, settled after ` +
      `${((performance.now() - started) / 1000).toFixed(1)} s; ${triangles} triangles; ` +
      `${volumes.length} volumes\n`,
  );
} finally {
  await browser.close();
  await chromium.close();
  await host.stop();
}
