/**
 * Measures the CPU time of a frame of the split screen, 1600 x 720 pixels: what a phone draws for two eyes.
 *
 * The view stands still before the whole specimen, at high quality. The CPU time is that of the process that draws,
 * which is meaningful for software. Several built viewers are measured alternately, so that their ratio depends little
 * on what else the machine does.
 */
import type { CDPSession, Page, Browser as Process } from "playwright-core";
import { enter } from "../test/support/browser/chromium";
import { drawingProcess_s } from "../test/support/browser/cpu_time";
import { Host } from "../test/support/browser/host";
import { ViewerPage } from "../test/support/browser/page";

const SIZE_PX = { width: 1600, height: 720 } as const;
const ROUNDS = 3;
/** CPU time of a round, s, of which the system counts hundredths. */
const ROUND_S = 1;
const MIN_FRAMES = 4;
const MAX_FRAMES = 50;
/** Number of frames that are drawn before those that count. */
const WARM_UP_FRAMES = 2;
/** Query of each mode. The disc shows from any distance up to 9 m. */
const MODES = {
  surfaces: "mode=off",
  disc: "mode=disc&switch=9",
  "all volumes": "mode=all&switch=9",
} as const;

export type SplitFrame = Readonly<{
  mode: string;
  /** Folder of the built viewer. */
  viewer: string;
  /** CPU time of a frame in each round, ms. */
  cpu_ms: readonly number[];
}>;

/**
 * Measures each mode in each of the viewers, and yields the frames of a mode as soon as they are measured.
 *
 * @param viewers folders of built viewers
 */
export async function* measureSplitFrames(
  chromium: Process,
  bundle: string,
  viewers: readonly string[],
): AsyncGenerator<readonly SplitFrame[]> {
  const mounts = viewers.map((viewer, i) => [`/viewer${i}/`, viewer] as const);
  const host = await Host.start({ ...Object.fromEntries(mounts), "/bundle/": bundle });
  try {
    for (const [mode, query] of Object.entries(MODES)) {
      const addresses = mounts.map(
        ([path]) => `${host.address}${path}?bundle=../bundle/&quality=high&${query}`,
      );
      const times = await measureAlternately(chromium, addresses);
      yield times.map((cpu_ms, i) => ({ mode, viewer: viewers[i], cpu_ms }));
    }
  } finally {
    await host.stop();
  }
}

async function measureAlternately(
  chromium: Process,
  addresses: readonly string[],
): Promise<readonly (readonly number[])[]> {
  const browser = await enter(chromium, { viewport: SIZE_PX, pixelRatio: 1 });
  const session = await chromium.newBrowserCDPSession();
  try {
    // Code that tsx compiles uses a helper to name functions, also in functions that run in the page.
    await browser.context.addInitScript("globalThis.__name = (each) => each");
    await browser.context.addInitScript(addHold);
    const pages: { page: Page; frames: number; cpu_ms: number[] }[] = [];
    for (const address of addresses) {
      const page = await browser.context.newPage();
      await openSplit(page, address);
      const first_ms = await cpuOfFrame(session, page, 1);
      const frames = Math.ceil((1000 * ROUND_S) / Math.max(first_ms, 1));
      pages.push({
        page,
        frames: Math.min(MAX_FRAMES, Math.max(MIN_FRAMES, frames)),
        cpu_ms: [],
      });
    }
    for (let round = 0; round < ROUNDS; round++) {
      for (const { page, frames, cpu_ms } of pages) {
        cpu_ms.push(await cpuOfFrame(session, page, frames));
      }
    }
    return pages.map(({ cpu_ms }) => cpu_ms);
  } finally {
    await browser.close();
  }
}

/** Opens the split screen, waits until all has loaded, and stops its frames. */
async function openSplit(page: Page, address: string): Promise<void> {
  const viewer = new ViewerPage(page);
  await viewer.open(address);
  await viewer.settled();
  await page.keyboard.press("j"); // This turns choosing by gaze off, since a resting gaze would select a tile.
  await page.keyboard.press("P");
  await page.waitForFunction(() => window.stereocell?.snapshot().isStereo === true);
  await viewer.settled();
  await viewer.drawn(2);
  await page.evaluate(() => window.holdFrames?.(true));
  const size = await page.evaluate(() => {
    const gl = document.querySelector("canvas")?.getContext("webgl2");
    return gl ? [gl.drawingBufferWidth, gl.drawingBufferHeight] : [];
  });
  if (size.join() !== `${SIZE_PX.width},${SIZE_PX.height}`) {
    throw new Error(`expected ${SIZE_PX.width} x ${SIZE_PX.height} pixels, found ${size}`);
  }
}

/** Returns the CPU time of one of `frames` frames, ms. Frames right after a pause take longer and don't count. */
async function cpuOfFrame(session: CDPSession, page: Page, frames: number): Promise<number> {
  await draw(page, WARM_UP_FRAMES);
  const before_s = await drawingProcess_s(session);
  const drawn = await draw(page, frames);
  return (1000 * ((await drawingProcess_s(session)) - before_s)) / drawn;
}

/** Draws at least `frames` frames, waits until they are on screen, and returns their number. */
function draw(page: Page, frames: number): Promise<number> {
  return page.evaluate(async (count) => {
    const viewer = window.stereocell;
    const gl = document.querySelector("canvas")?.getContext("webgl2");
    if (viewer === undefined || !gl) throw new Error("the page shows no viewer");
    const first = viewer.frames;
    window.holdFrames?.(false);
    while (viewer.frames < first + count) await new Promise((go) => setTimeout(go, 5));
    window.holdFrames?.(true);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return viewer.frames - first;
  }, frames);
}

/** Lets the script stop a page's frames, because the split screen draws all the time. Runs in the page. */
function addHold(): void {
  const next = window.requestAnimationFrame.bind(window);
  const held: FrameRequestCallback[] = [];
  let isHeld = false;
  window.requestAnimationFrame = (draw) => (isHeld ? -held.push(draw) : next(draw));
  window.holdFrames = (isToHold) => {
    isHeld = isToHold;
    if (!isHeld) for (const draw of held.splice(0)) next(draw);
  };
}

declare global {
  interface Window {
    holdFrames?: (isToHold: boolean) => void;
  }
}
