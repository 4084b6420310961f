/** Headless Chromium, with software WebGL or a GPU's. */
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { type BrowserContext, chromium, type Page, type Browser as Process } from "playwright-core";
import { IS_EXHAUSTIVE } from "../exhaustive";

export const CHROMIUM = process.env.CHROMIUM || "/usr/bin/chromium";
export const HOW_TO_GET = `no Chromium at ${CHROMIUM}: apt-get install chromium, or set CHROMIUM to its path`;

/** Features of the browser's window, which no test sees, and those that playwright also switches off. */
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
/** Mesa's entry in the list of EGL vendors. */
const MESA = "/usr/share/glvnd/egl_vendor.d/50_mesa.json";
const BY_MESA = ["--use-angle=gl-egl"];
const BY_SWIFTSHADER = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const SOFTWARE = [
  // the page around the canvas is drawn without the software GPU, which would take most of the time
  "--disable-gpu-compositing",
  "--disable-gpu-rasterization",
];
/**
 * Uses only Mesa, even if there is a graphics card, and no threads of Mesa's own, which wait for
 * one another.
 */
const ENVIRONMENT = {
  __EGL_VENDOR_LIBRARY_FILENAMES: MESA,
  LIBGL_ALWAYS_SOFTWARE: "1",
  LP_NUM_THREADS: "0",
};

export function hasChromium(): boolean {
  return existsSync(CHROMIUM);
}

export type Browser = Readonly<{ context: BrowserContext; close: () => Promise<void> }>;

/**
 * Conditions of a page: its size in CSS pixels, which is small because software draws it, and the
 * abilities of the device.
 */
export type Surroundings = Readonly<{
  viewport: { width: number; height: number };
  /** Device pixels per CSS pixel; 0.5 unless a test looks at details. */
  pixelRatio?: number;
  hasTouch?: boolean;
  /**
   * Whether nothing is drawn, for tests that look at no pixels, since drawing by software takes
   * most of the time.
   */
  isBlind?: boolean;
  /**
   * Whether there is a rest between frames, three times as long as the last frame. For stereo,
   * which draws continuously.
   */
  hasRests?: boolean;
  serviceWorkers?: "allow" | "block";
}>;

/**
 * Starts the browser in a profile that is deleted when it closes. STEREOCELL_GPU_FLAGS has
 * Chromium's flags for a GPU. Without them, Mesa draws in two thirds of the time of SwiftShader,
 * Chromium's own software. SwiftShader draws if Mesa cannot, and in exhaustive runs, so that both
 * are tested.
 */
export async function startChromium(): Promise<Process> {
  if (!hasChromium()) throw new Error(HOW_TO_GET);
  const ofGpu = process.env.STEREOCELL_GPU_FLAGS?.split(" ");
  if (ofGpu !== undefined) return launch(ofGpu);
  if (existsSync(MESA) && !IS_EXHAUSTIVE) {
    const started = await launch([...BY_MESA, ...SOFTWARE], ENVIRONMENT);
    if (await hasWebGl(started)) return started;
    await started.close();
  }
  return launch([...BY_SWIFTSHADER, ...SOFTWARE]);
}

function launch(flags: readonly string[], environment = {}): Promise<Process> {
  return chromium.launch({
    executablePath: CHROMIUM,
    headless: false, // playwright's switch is the old headless mode; the flag below is the new one
    args: ["--headless=new", ...FLAGS, ...flags],
    env: { ...process.env, ...environment },
  });
}

/** Returns whether pages have WebGL. */
async function hasWebGl(browser: Process): Promise<boolean> {
  const page = await browser.newPage();
  const isThere = await page.evaluate(
    () => document.createElement("canvas").getContext("webgl2") !== null,
  );
  await page.context().close();
  return isThere;
}

/**
 * Milliseconds that an action waits for its element at most. Playwright's own 30 s are too short
 * while other programs use the cores. The time limit of a test is longer, so a missing element ends
 * the action first.
 */
const PATIENCE_MS = 150_000;

/** Opens a separate context in the browser, which shares nothing with others. */
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
    reducedMotion: "reduce", // otherwise the opening view would turn, and never come to rest
    colorScheme: "dark",
    contrast: "more", // a background of one colour, which tests distinguish from the specimen
  });
  context.setDefaultTimeout(PATIENCE_MS);
  await context.addInitScript(() => {
    // the card at the start of stereo would cover the view; it is not shown to users who have seen
    // it
    if (location.protocol.startsWith("http")) localStorage.setItem("stereocell-introductions", "3");
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
 * Gives the page an emulated headset (iwer, `window.headset`), before its own scripts run.
 *
 * The headset draws continuously. Unless a test needs many frames, most of the time is left to
 * other work.
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
    // the emulator gives the canvas the size of the window, which the page's style would compress
    document.addEventListener("DOMContentLoaded", () => {
      const sheet = new CSSStyleSheet(); // the page's policy allows no other kind of style
      sheet.replaceSync(
        "[data-webxr_runtime] canvas { width: 100% !important; height: 100% !important; }",
      );
      document.adoptedStyleSheets.push(sheet);
    });
  });
  if (!needsFrames) await restBetweenFrames(page);
}

/** Ratio of the rest between frames to the time of a frame. */
const REST = 3;

/** Leaves most of the time to other work. Must be called before the page opens. */
export async function restBetweenFrames(pages: Page | BrowserContext): Promise<void> {
  await pages.addInitScript((rest) => {
    const next = window.requestAnimationFrame.bind(window);
    const cancelled = new Set<number>();
    let handles = 0;
    window.requestAnimationFrame = (draw) => {
      const handle = ++handles;
      const start = performance.now();
      next(() => {
        const took_ms = performance.now() - start; // time of the frame that was drawn before
        setTimeout(() => next((time) => cancelled.delete(handle) || draw(time)), rest * took_ms);
      });
      return handle;
    };
    window.cancelAnimationFrame = (handle) => cancelled.add(handle);
  }, REST);
}
