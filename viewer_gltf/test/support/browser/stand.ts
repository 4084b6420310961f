/** What a browser test stands on: a bundle served beside the built viewer, Chromium, a page. */
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
/** The bundle that `make test` built of the demo, if it did. */
export const DEMO_BUNDLE = process.env.STEREOCELL_TEST_BUNDLE;
/** A bundle that was built with `--maps`, of real data. */
export const MAPS_BUNDLE = process.env.STEREOCELL_REAL_BUNDLE;
/** A bundle of an MR head, of one tile. */
export const HEAD_BUNDLE = process.env.STEREOCELL_HEAD_BUNDLE;

export type Stand = Readonly<{
  /** Its folder. */
  bundle: string;
  manifest: Manifest;
  host: Host;
  /** A page, not opened yet. Tests have it one after another: only a test can leave traces in it. */
  viewer: ViewerPage;
  /**
   * Open the bundle in it, seen from the front; `query` goes behind the bundle's address.
   *
   * The fixture has no depth shading unless its link says `depth=`: it takes a third of the time until
   * volumes are drawn. Built bundles have it, as they have for users; in exhaustive runs all have it.
   */
  open: (query?: string) => Promise<void>;
}>;

export type StandOptions = Readonly<{
  /** A bundle's folder; without one, the synthetic fixture's. */
  bundle?: string;
  /** Of a fixture of its own. */
  fixture?: FixtureOptions;
  /** CSS pixels; small ones, since software draws them. */
  viewport: { width: number; height: number };
  /** Of the device to one of CSS: half of one, but where a picture's detail is looked at. */
  pixelRatio?: number;
  hasTouch?: boolean;
  /** Nothing is drawn. */
  isBlind?: boolean;
  /** The panel is as somebody finds it who has never been there. */
  isFirstVisit?: boolean;
  /** Between frames thrice the time passes that the last one took. */
  hasRests?: boolean;
  /** The page stays open from test to test of the `describe`, none of which disturbs another. */
  sharesPage?: boolean;
  /** Served beside the viewer (`/app/`) and the bundle (`/bundle/`), by prefix. */
  mounts?: (bundle: string) => Readonly<Record<string, string>>;
}>;

/** The sections of the panel that a reader has opened, whose controls most tests use. */
const OPEN =
  "channels objects additions volumes tiles stereo slices save more view volume-settings light";

/** Opens the sections as on a later visit. It runs in the page before the page's own scripts. */
function openSections(open: string): void {
  try {
    if (localStorage.getItem("stereocell-open") === null) {
      localStorage.setItem("stereocell-open", open);
    }
  } catch {
    // about:blank has no storage
  }
}

/** Set up and cleared away around the tests of one `describe`; to be used inside them. */
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
    // its own requests would be counted with the page's
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

  /** Whether the page has scripts that run before its own: there is no way to take them away. */
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

  /** A page that navigates costs half of what a new one does. */
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
    host.reset(); // what the page still asked for is forgotten, too
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
      const view = query.includes("&view=") ? "" : "&view=front"; // where points are known to show
      const [, search, link = ""] = /^([^#]*)(.*)$/.exec(query) ?? [];
      const hash = hasDepthShading || link.includes("&depth=") ? link : `${link || "#v=1"}&depth=0`;
      return viewer.open(`${host.address}/app/?bundle=../bundle/${search}${view}${quality}${hash}`);
    },
  };
}
