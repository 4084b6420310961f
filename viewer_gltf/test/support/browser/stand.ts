/** The set-up of a browser test: a bundle served beside the built viewer, Chromium, and a page. */
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, afterEach, beforeAll, inject } from "vitest";
import type { Manifest } from "../../../src/bundle/generated/bundle";
import { IS_EXHAUSTIVE } from "../exhaustive";
import { type FixtureOptions, writeFixture } from "../fixture/bundle";
import type { Browser } from "./chromium";
import { Host } from "./host";
import { ViewerPage } from "./page";
import { openBrowser } from "./shared_browser";

export const DIST = new URL("../../../dist/", import.meta.url).pathname;
/** The bundle that `make test` has built of the demo, if any. */
export const DEMO_BUNDLE = process.env.STEREOCELL_TEST_BUNDLE;
/** A bundle of real data, built with `--maps`. */
export const MAPS_BUNDLE = process.env.STEREOCELL_REAL_BUNDLE;
/** A bundle of an MR head, with one tile. */
export const HEAD_BUNDLE = process.env.STEREOCELL_HEAD_BUNDLE;

export type Stand = Readonly<{
  /** Folder of the bundle. */
  bundle: string;
  manifest: Manifest;
  host: Host;
  /** A page that is not opened yet. Tests use it one after another. */
  viewer: ViewerPage;
  /**
   * Opens the bundle in the page, seen from the front; `query` follows the address of the bundle.
   *
   * The fixture has no depth shading unless its link has `depth=`, because that takes a third of
   * the time until volumes are drawn. Built bundles have it, as for users. In exhaustive runs all
   * bundles have it.
   */
  open: (query?: string) => Promise<void>;
}>;

export type StandOptions = Readonly<{
  /** Folder of a bundle; absent: the synthetic fixture. */
  bundle?: string;
  /** Options of a fixture that is written for these tests. */
  fixture?: FixtureOptions;
  /** CSS pixels; small, because software draws them. */
  viewport: { width: number; height: number };
  /** Device pixels per CSS pixel; 0.5 unless a test looks at details. */
  pixelRatio?: number;
  hasTouch?: boolean;
  /** Whether nothing is drawn. */
  isBlind?: boolean;
  /** Whether the panel is in the state of a first visit. */
  isFirstVisit?: boolean;
  /** Whether there is a rest between frames, three times as long as the last frame. */
  hasRests?: boolean;
  /** Whether the page stays open for all tests of the `describe`, which do not disturb one another. */
  sharesPage?: boolean;
  /** Folders that are served beside the viewer (`/app/`) and the bundle (`/bundle/`), by prefix. */
  mounts?: (bundle: string) => Readonly<Record<string, string>>;
}>;

/** Sections of the panel that are open, because most tests use their controls. */
const OPEN =
  "channels objects additions volumes tiles stereo slices save more view volume-settings light";

/** Opens the sections as on a later visit. Runs in the page before its own scripts. */
function openSections(open: string): void {
  try {
    if (localStorage.getItem("stereocell-open") === null) {
      localStorage.setItem("stereocell-open", open);
    }
  } catch {
    // about:blank has no storage
  }
}

/** Sets up and closes everything around the tests of one `describe`. Must be called inside it. */
export function prepareStand(options: StandOptions): Stand {
  const { bundle: given, fixture, viewport, pixelRatio, hasTouch, mounts } = options;
  const { isBlind, hasRests, sharesPage = false } = options;
  const hasDepthShading = given !== undefined || IS_EXHAUSTIVE;
  let folder: string | undefined;
  let bundle: string;
  let manifest: Manifest;
  let host: Host;
  let browser: Browser;
  let viewer: ViewerPage;

  beforeAll(async () => {
    if (fixture !== undefined) {
      folder = await mkdtemp(join(tmpdir(), "stereocell-fixture-"));
      await writeFixture(folder, fixture);
    }
    bundle = given ?? folder ?? inject("fixture");
    manifest = JSON.parse(await readFile(join(bundle, "manifest.json"), "utf8"));
    host = await Host.start({ "/app/": DIST, "/bundle/": bundle, ...mounts?.(bundle) });
    // requests of a service worker would be counted with those of the page
    browser = await openBrowser({
      ...{ viewport, pixelRatio, hasTouch, isBlind, hasRests },
      serviceWorkers: "block",
    });
    await openPage();
  });

  afterAll(async () => {
    await browser?.close();
    await host?.stop();
    if (folder !== undefined) await rm(folder, { recursive: true, force: true });
  });

  /** Whether the page has scripts that run before its own. They cannot be removed. */
  let isAltered = false;

  const openPage = async () => {
    const page = await browser.context.newPage();
    const addInitScript = page.addInitScript.bind(page);
    page.addInitScript = (...given: Parameters<typeof addInitScript>) => {
      isAltered = true;
      return addInitScript(...given);
    };
    isAltered = false;
    if (!options.isFirstVisit) await addInitScript(openSections, OPEN);
    viewer = new ViewerPage(page);
  };

  /** Empties the page. A navigation costs half as much as a new page. */
  const clearPage = async () => {
    const { page } = viewer;
    await page.context().setOffline(false);
    await page.goto("about:blank");
    await page.unrouteAll();
    page.removeAllListeners();
    await page.mouse.move(-1, -1);
    await page.setViewportSize(viewport);
  };

  afterEach(async ({ task }) => {
    if (!sharesPage && (isAltered || task.result?.state === "fail")) {
      await viewer.page.close();
      await openPage();
    } else if (!sharesPage) await clearPage();
    host.reset(); // late requests of the page are forgotten, too
  });

  return {
    get bundle() {
      return bundle;
    },
    get manifest() {
      return manifest;
    },
    get host() {
      return host;
    },
    get viewer() {
      return viewer;
    },
    open: (query = "") => {
      const quality = query.includes("&quality=") ? "" : "&quality=low";
      // the view in which tests know the places of points
      const view = query.includes("&view=") ? "" : "&view=front";
      const [, search, link = ""] = /^([^#]*)(.*)$/.exec(query) ?? [];
      const hash = hasDepthShading || link.includes("&depth=") ? link : `${link || "#v=1"}&depth=0`;
      return viewer.open(`${host.address}/app/?bundle=../bundle/${search}${view}${quality}${hash}`);
    },
  };
}
