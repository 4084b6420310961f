/** Headless Chromium, with software WebGL or a GPU's. */
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { type BrowserContext, chromium, type Page, type Browser as Process } from "playwright-core";
import { IS_EXHAUSTIVE } from "../exhaustive";

export const CHROMIUM = process.env.CHROMIUM || "/usr/bin/chromium";
export const HOW_TO_GET = `no Chromium at ${CHROMIUM}: apt-get install chromium, or set CHROMIUM to its path`;

/** Features of the browser's own window, which nobody sees; and those of playwright's own list. */
const WITHOUT = [
  ...["WebUIOmniboxPopup", "WebUIOmniboxAimPopup"],
  "SpareRendererForSitePerProcess",
  ...["AvoidUnnecessaryBeforeUnloadCheckSync", "DestroyProfileOnBrowserClose", "HttpsUpgrades"],
  ...["HttpsFirstBalancedModeAutoEnable", "LensOverlay", "MediaRouter", "PaintHolding"],
  ...["ThirdPartyStoragePartitioning", "AvoidCorsURLLoaderRestartOnRedirect", "OptimizationHints"],
  ...["NetworkTimeServiceQuerying", "AimEnabled", "PreconnectToSearch"],
];
const FLAGS = [
  `--disable-features=${WITHOUT.join(",")}`,
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--ignore-gpu-blocklist",
];
/** Where the vendors of EGL are listed, Mesa is this one. */
const MESA = "/usr/share/glvnd/egl_vendor.d/50_mesa.json";
const BY_MESA = ["--use-angle=gl-egl"];
const BY_SWIFTSHADER = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const SOFTWARE = [
  // what is round the canvas is drawn without the software GPU, which takes most of it otherwise
  "--disable-gpu-compositing",
  "--disable-gpu-rasterization",
];
/** Mesa alone, and no graphics card, though one be there; no threads of its own, which wait for one another. */
const ENVIRONMENT = {
  __EGL_VENDOR_LIBRARY_FILENAMES: MESA,
  LIBGL_ALWAYS_SOFTWARE: "1",
  LP_NUM_THREADS: "0",
};

export function hasChromium(): boolean {
  return existsSync(CHROMIUM);
}

export type Browser = Readonly<{ context: BrowserContext; close: () => Promise<void> }>;

/** What a page finds: CSS pixels, small ones, since software draws them; and what a device has. */
export type Surroundings = Readonly<{
  viewport: { width: number; height: number };
  /** Of the device to one of CSS: half of one, but where a picture's detail is looked at. */
  pixelRatio?: number;
  hasTouch?: boolean;
  /** Nothing is drawn: where no picture is looked at, software's drawing is most of the time. */
  isBlind?: boolean;
  /** Between frames thrice the time passes that the last one took: of stereo, which draws frame after frame. */
  hasRests?: boolean;
  serviceWorkers?: "allow" | "block";
}>;

/**
 * Start the browser, in a profile that goes when it closes. STEREOCELL_GPU_FLAGS holds Chromium's flags for
 * a GPU; without them Mesa's software draws, in two thirds of the time of Chromium's own, SwiftShader. That
 * draws where Mesa can't, and in exhaustive runs: so both are tried now and then.
 */
export async function startChromium(): Promise<Process> {
  if (!hasChromium()) throw new Error(HOW_TO_GET);
  const ofGpu = process.env.STEREOCELL_GPU_FLAGS?.split(" ");
  if (ofGpu !== undefined) return launch(ofGpu);
  if (existsSync(MESA) && !IS_EXHAUSTIVE) {
    const started = await launch([...BY_MESA, ...SOFTWARE], ENVIRONMENT);
    if (await draws(started)) return started;
    await started.close();
  }
  return launch([...BY_SWIFTSHADER, ...SOFTWARE]);
}

function launch(flags: readonly string[], environment = {}): Promise<Process> {
  return chromium.launch({
    executablePath: CHROMIUM,
    headless: false, // playwright's own switch is the old mode; the flag below is the new one
    args: ["--headless=new", ...FLAGS, ...flags],
    env: { ...process.env, ...environment },
  });
}

/** Whether pages have WebGL. */
async function draws(browser: Process): Promise<boolean> {
  const page = await browser.newPage();
  const isThere = await page.evaluate(
    () => document.createElement("canvas").getContext("webgl2") !== null,
  );
  await page.context().close();
  return isThere;
}

/**
 * Longest time that an action waits for its element, ms. Playwright's own 30 s are too short while other
 * programs use the cores. The time limit of the test is longer, and ends an action that waits in vain.
 */
const PATIENCE_MS = 150_000;

/** Pages of their own in a browser: nothing is kept of others, or for them. */
export async function enter(
  browser: Process,
  {
    viewport,
    pixelRatio = 0.5,
    hasTouch = false,
    isBlind = false,
    hasRests = false,
    serviceWorkers = "allow",
  }: Surroundings,
): Promise<Browser> {
  const context = await browser.newContext({
    viewport,
    deviceScaleFactor: pixelRatio,
    hasTouch,
    serviceWorkers,
    reducedMotion: "reduce", // what opens with a turn would never come to rest
    colorScheme: "dark",
    contrast: "more", // a background of one colour, which tests tell from the specimen
  });
  context.setDefaultTimeout(PATIENCE_MS);
  await context.addInitScript(() => {
    // the card at the beginning of stereo lies over pictures: whoever has seen it gets none
    if (location.protocol.startsWith("http")) localStorage.setItem("stereocell-told", "3");
  });
  if (isBlind) {
    await context.addInitScript(() => {
      const { prototype } = WebGL2RenderingContext;
      const undrawn = [
        "drawArrays",
        "drawElements",
        "drawArraysInstanced",
        "drawElementsInstanced",
      ];
      for (const name of undrawn) Object.assign(prototype, { [name]: () => undefined });
    });
  }
  if (hasRests) await restBetweenFrames(context);
  return { context, close: () => context.close() };
}

/**
 * Give the page an emulated headset (iwer, `window.headset`), before its own scripts run.
 *
 * It draws frame after frame; unless a test needs many, most of the time is left to what goes on
 * beside.
 */
export async function addHeadset(page: Page, needsFrames = false): Promise<void> {
  const script = new URL(import.meta.resolve("iwer/build/iwer.min.js"));
  await page.addInitScript(await readFile(script, "utf8"));
  await page.addInitScript(() => {
    const { XRDevice, metaQuest3 } = (window as unknown as { IWER: typeof import("iwer") }).IWER;
    const device = new XRDevice(metaQuest3, { stereoEnabled: true });
    device.installRuntime({ forceInstall: true }); // Chromium has a runtime, but no headset
    device.position.set(0, 1.6, 0);
    Object.assign(window, { headset: device }); // for tests to move
    // The emulator gives the canvas the window's size; the page's own style would squash it.
    document.addEventListener("DOMContentLoaded", () => {
      const sheet = new CSSStyleSheet(); // the page's policy allows no other
      sheet.replaceSync(
        "[data-webxr_runtime] canvas { width: 100% !important; height: 100% !important; }",
      );
      document.adoptedStyleSheets.push(sheet);
    });
  });
  if (!needsFrames) await restBetweenFrames(page);
}

/** Time between frames, to that of a frame. */
const REST = 3;

/** Leave most of the time to what goes on beside. It must be called before the page opens. */
export async function restBetweenFrames(pages: Page | BrowserContext): Promise<void> {
  await pages.addInitScript((rest) => {
    const next = window.requestAnimationFrame.bind(window);
    const cancelled = new Set<number>();
    let handles = 0;
    window.requestAnimationFrame = (draw) => {
      const handle = ++handles;
      const start = performance.now();
      next(() => {
        const took_ms = performance.now() - start; // of the frame that was drawn before
        setTimeout(() => next((time) => cancelled.delete(handle) || draw(time)), rest * took_ms);
      });
      return handle;
    };
    window.cancelAnimationFrame = (handle) => cancelled.add(handle);
  }, REST);
}
