/**
 * The pictures of the documentation, drawn by headless Chromium from built samples: `make docs-pictures`.
 *
 *   npm run docs-pictures -- OUT [NAME ...]
 *
 * OUT holds the builds of `make demo`: `demo`, `cells` and `mri-demo`. Each picture is written to docs/pictures as a
 * WebP file. With names, only these pictures are drawn.
 */
import { mkdir, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { startChromium } from "../test/support/browser/chromium";
import { Host } from "../test/support/browser/host";
import { ViewerPage } from "../test/support/browser/page";

/** Quality of the WebP files, 0 to 100. At 60 the edges of letters are still sharp. */
const QUALITY = 60;
const PICTURES = new URL("../../docs/pictures/", import.meta.url).pathname;

type Picture = Readonly<{
  sample: "demo" | "cells" | "mri-demo";
  /** Width and height of the page, CSS pixels. */
  size?: readonly [number, number];
  /** Query of the page's address. */
  query?: string;
  /** The actions of a user before the picture is taken. */
  act?: (viewer: ViewerPage) => Promise<void>;
}>;

/** Time, ms, after which an announcement about a pressed key has disappeared from the view. */
const SPOKEN_MS = 9000;

/** Samples of each pixel from which a path-traced image shows no noise; two cores take about 12 minutes. */
const CLEAR_SAMPLES = 32;

const SMALL = [640, 360] as const;
const WITH_PANEL = [1000, 560] as const;

/** Returns an action that presses keys one after the other; names are those in the list of keys. */
function press(...keys: readonly string[]): NonNullable<Picture["act"]> {
  return async (viewer) => {
    for (const key of keys) {
      await viewer.page.keyboard.press(key);
      await viewer.settled();
    }
    await viewer.page.waitForTimeout(SPOKEN_MS);
  };
}

/** Zooms in with the wheel, which makes no announcement on the view. */
async function goNearer(viewer: ViewerPage): Promise<void> {
  const box = await viewer.page.locator(".stage").boundingBox();
  if (box === null) throw new Error("the page has no picture");
  await viewer.page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  for (let i = 0; i < 4; i++) await viewer.page.mouse.wheel(0, -200);
  await viewer.page.waitForTimeout(1000); // the zoom continues for a moment
  await viewer.settled();
}

/** Clicks at a place of the view, given as shares of its width and height. */
async function click(viewer: ViewerPage, across: number, down: number): Promise<void> {
  const box = await viewer.page.locator(".stage").boundingBox();
  if (box === null) throw new Error("the page has no picture");
  await viewer.clickOnce(box.x + across * box.width, box.y + down * box.height);
  await viewer.settled();
}

/** Opens a section of the panel and scrolls its heading to the upper end of the panel. */
async function show(viewer: ViewerPage, section: string): Promise<void> {
  await viewer.unfold(section);
  await viewer.page.locator(`h2 [data-opener="${section}"]`).evaluate((heading) => {
    // scrollIntoView() would scroll the page as well
    const section = heading.closest("section") ?? heading;
    let list = section.parentElement;
    while (list !== null && list.scrollHeight <= list.clientHeight) list = list.parentElement;
    const past = heading.getBoundingClientRect().top - (list?.getBoundingClientRect().top ?? 0);
    list?.scrollBy(0, past);
  });
  await viewer.settled();
}

const TABLE: Readonly<Record<string, Picture>> = {
  opening: { sample: "demo", size: [1280, 720] },
  "mode-off": { sample: "demo", size: SMALL, query: "panel=off&mode=off", act: goNearer },
  "mode-disc": { sample: "demo", size: SMALL, query: "panel=off&mode=disc", act: goNearer },
  "mode-all": { sample: "demo", size: SMALL, query: "panel=off&mode=all", act: goNearer },
  "path-tracing": {
    sample: "mri-demo",
    size: SMALL,
    query: "panel=off&mode=traced",
    act: async (viewer) => {
      while ((await viewer.snapshot()).traced.samples < CLEAR_SAMPLES)
        await viewer.page.waitForTimeout(1000);
    },
  },
  "card-of-a-place": {
    sample: "demo",
    size: WITH_PANEL,
    act: (viewer) => click(viewer, 0.5, 0.5),
  },
  "channel-card": {
    sample: "demo",
    size: WITH_PANEL,
    act: (viewer) => viewer.openCard("CD31"),
  },
  "value-and-gradient": {
    sample: "demo",
    size: WITH_PANEL,
    act: async (viewer) => {
      await press("H")(viewer);
      await viewer.page.getByText("+ Rectangle").click();
      await viewer.settled();
      await viewer.page.getByText("Value and gradient").scrollIntoViewIfNeeded();
    },
  },
  "cut-by-a-box": {
    sample: "demo",
    size: WITH_PANEL,
    query: "mode=off",
    act: async (viewer) => {
      await press("b", "N", ".", ".", ".", ".", ".", ".")(viewer);
      await show(viewer, "cut");
    },
  },
  slices: {
    sample: "mri-demo",
    size: WITH_PANEL,
    query: "mode=all",
    act: press("\\"),
  },
  measure: {
    sample: "demo",
    size: WITH_PANEL,
    query: "mode=off",
    act: async (viewer) => {
      await show(viewer, "measure");
      await press("p")(viewer);
      await click(viewer, 0.5, 0.3);
      await click(viewer, 0.52, 0.58);
    },
  },
  objects: {
    sample: "cells",
    size: WITH_PANEL,
    act: (viewer) => show(viewer, "objects"),
  },
  "split-screen": {
    sample: "demo",
    size: SMALL,
    query: "panel=off&mode=off",
    act: press("P"),
  },
  "red-cyan": { sample: "demo", size: SMALL, query: "panel=off&mode=off&stereo=anaglyph" },
  save: { sample: "demo", size: WITH_PANEL, act: (viewer) => show(viewer, "save") },
};

const [out, ...wanted] = process.argv.slice(2);
const unknown = wanted.filter((name) => !(name in TABLE));
if (out === undefined || unknown.length > 0) {
  process.stderr.write(`usage: npm run docs-pictures -- OUT [${Object.keys(TABLE).join(" ")}]\n`);
  process.exit(2);
}
await mkdir(PICTURES, { recursive: true });
const chromium = await startChromium();
try {
  for (const [name, { sample, size = WITH_PANEL, query = "", act }] of Object.entries(TABLE)) {
    if (wanted.length > 0 && !wanted.includes(name)) continue;
    const dist = new URL("../dist/", import.meta.url).pathname;
    const host = await Host.start({ "/": dist, "/bundle/": join(out, sample, "bundle") });
    const [width, height] = size;
    const context = await chromium.newContext({
      viewport: { width, height },
      colorScheme: "dark",
      reducedMotion: "reduce", // a specimen that turns never comes to rest
      serviceWorkers: "block",
    });
    context.setDefaultTimeout(240_000);
    const page = await context.newPage();
    const viewer = new ViewerPage(page);
    await viewer.open(`${host.address}/?bundle=bundle/&${query}`);
    await viewer.settled();
    await act?.(viewer);
    await viewer.settled();
    await viewer.drawn(3);
    const session = await context.newCDPSession(page);
    const { data } = await session.send("Page.captureScreenshot", {
      format: "webp",
      quality: QUALITY,
    });
    const bytes = Buffer.from(data, "base64");
    await writeFile(join(PICTURES, `${name}.webp`), bytes);
    process.stdout.write(`docs/pictures/${name}.webp: ${bytes.length} bytes\n`);
    await context.close();
    await host.stop();
  }
} finally {
  await chromium.close();
}
