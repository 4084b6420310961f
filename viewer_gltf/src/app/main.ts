/** Entry point: finds the bundle and shows it, or reports on the page why it cannot be shown. */
import "../panel/html/colors.css";
import "../panel/html/page.css";
import "../panel/html/panel.css";
import "../panel/html/widgets.css";
import "../panel/html/controls.css";
import "../panel/html/overlays.css";
import "../panel/html/forced_colors.css";
import { bundleAddress, namesBundle, pageAddress, sourceAddress } from "../bundle/address";
import { BundleError, MissingError } from "../bundle/errors";
import type { Manifest } from "../bundle/generated/bundle";
import { isHeld, releaseFiles } from "../bundle/held_files";
import type { LiveHost } from "../bundle/live_host";
import { type Bundle, loadBundle } from "../bundle/load";
import { watchWaiting } from "../bundle/retry";
import { element } from "../dom/element";
import { Host } from "../host/host";
import { leaveWheelToOuterPage } from "../interaction/frame_wheel";
import { isReading, whileReading } from "../live/reading";
import { sizeText } from "../math/length_text";
import { showFatal } from "../panel/html/overlays";
import type { Theme } from "../render/theme";
import { withTyped } from "../share/address";
import { loadLink, openAddress } from "../share/open_address";
import { isLight, isPlain, panelOf } from "../share/page_parameters";
import type { ShownSource } from "../source/open_source";
import type { StereoCellApi } from "./automation_api";
import * as parts from "./parts";

function checkWebGl2(): void {
  if (document.createElement("canvas").getContext("webgl2") !== null) return;
  throw new BundleError(
    "This browser offers no WebGL 2, which the viewer draws with. Try a current Chrome, Edge, " +
      "Firefox or Safari, and check that hardware acceleration is on in its settings.",
  );
}

/** Returns the specimen's size and number of tiles, for example `512 x 205 x 54 um · 2 tiles`. */
function describeSize({ specimen, tiles }: Manifest): string {
  const { min, max } = specimen.bounds_um;
  return `${sizeText(max.map((v, i) => v - min[i]))} · ${tiles.length} ${tiles.length === 1 ? "tile" : "tiles"}`;
}

/** Shows a text on the start page, which stays until the specimen is drawn (see boot/). */
function showStartText(text: string): void {
  const words = document.querySelector("[data-boot] p");
  if (words !== null) words.textContent = text;
}

const LIGHT = matchMedia("(prefers-color-scheme: light)");
const CONTRAST = matchMedia("(prefers-contrast: more)");

/** Applies the theme of the address or the system to the page. */
function applyTheme(): Theme {
  const theme = isLight(new URL(pageAddress()).search, LIGHT.matches) ? "light" : "dark";
  document.documentElement.dataset.theme = theme;
  return theme;
}

/** Follows the theme of the system, which may change at night, also with the background of the view. */
function followSystem(host: Host, search: string): void {
  const update = () => host.setTheme(applyTheme(), isPlain(search, CONTRAST.matches));
  for (const query of [LIGHT, CONTRAST]) query.addEventListener("change", update);
  update();
}

async function open(parent: HTMLElement): Promise<Host> {
  applyTheme();
  checkWebGl2();
  const page = pageAddress();
  const { search, hash } = new URL(page);
  const [{ bundle, notes }, readLink] = await Promise.all([
    openShown(parent, page),
    loadLink(withTyped(hash)),
  ]);
  const made = await openIn(parent, bundle, (host) => {
    notify(host, notes);
    openAddress(host, search, readLink);
  });
  if (isHeld(bundle.base)) void followDrops(parent);
  if (bundle.live !== undefined) followBuild(bundle, bundle.live);
  return made;
}

/**
 * Opens the bundle that the address names, or the source, which the page then reads itself. If the
 * address names neither and there is no bundle beside the page, the user chooses a source.
 */
async function openShown(parent: HTMLElement, page: string): Promise<ShownSource> {
  const source = sourceAddress(page);
  if (source !== null) {
    showStartText("Reading the source");
    const { openAddress } = await import("../source/open_source");
    return openAddress(source, showStartText);
  }
  showStartText("Reading the bundle");
  try {
    const base = bundleAddress(page);
    const bundle = loadBundle(base);
    const shown = isReading() ? whileReading(base, bundle, showStartText) : bundle;
    return { bundle: await shown, notes: [] };
  } catch (error) {
    if (!(error instanceof MissingError) || namesBundle(page)) throw error;
    const { chooseSource } = await import("../source/start_page");
    return chooseSource(parent);
  }
}

/** Shows each file or folder that is dropped, in place of the one before. */
async function followDrops(parent: HTMLElement): Promise<void> {
  const [{ acceptDrops }, { openLocal }] = await Promise.all([
    import("../source/dropped"),
    import("../source/open_source"),
  ]);
  acceptDrops(async (source) => {
    const before = host ?? (await opened);
    try {
      const { bundle, notes } = await openLocal(source, (text) => before.announce(text));
      before.dispose();
      releaseFiles(before.bundle.base);
      host = await openIn(parent, bundle, (after) => notify(after, notes));
      await host.noteOverview();
    } catch (error) {
      if (!(error instanceof BundleError)) throw error;
      before.dispatch({ type: "notify", text: error.message });
    }
  });
}

function notify(host: Host, notes: readonly string[]): void {
  for (const text of notes) host.dispatch({ type: "notify", text }, false);
}

/**
 * Follows the build behind the page: each newer bundle that the build offers (a view) replaces the
 * one before.
 */
function followBuild({ base }: Bundle, live: LiveHost): void {
  const root = base.slice(0, base.length - live.folder.length);
  const show = async (newer: string) => {
    await ready;
    const { exchange } = await import("./exchange");
    const loaded = await loadBundle(newer);
    const bundle = newer === root ? loaded : { ...loaded, live };
    if (host === null) return;
    host = await exchange(host, (parent) => openIn(parent, bundle, () => undefined));
    // the page shows the bundle all the same, so a failure is ignored
    void host.noteOverview().catch(() => undefined);
  };
  const shown = live.folder === "" ? "" : base;
  const isLate = () => host?.display.isLate ?? false;
  void import("../live/watch_build").then(({ watchBuild }) =>
    watchBuild({ live, root, shown, show, isLate }),
  );
}

/**
 * Makes the page of a bundle in an element. The function `place` sets the camera and the settings
 * with which it opens.
 */
async function openIn(
  parent: HTMLElement,
  bundle: Bundle,
  place: (host: Host) => void,
): Promise<Host> {
  const { search } = new URL(pageAddress());
  document.title = `${bundle.manifest.specimen.name} · StereoCell`;
  document.documentElement.dataset.panel = panelOf(search);

  const host = makeHost(parent, bundle);
  followSystem(host, search);
  host.panel.addFacts({ subtitle: describeSize(bundle.manifest) });
  place(host);
  await host.noteOpening();
  return host;
}

/** Makes the host and the elements of the view. */
function makeHost(parent: HTMLElement, bundle: Bundle): Host {
  const stage = element("div", { className: "stage" });
  stage.ariaLabel = "The specimen: the arrow keys turn it, ? lists all keys";
  stage.role = "group"; // the role "image" would hide the buttons in it from screen readers
  const view = element("main", { className: "view" }, {}, stage);
  parent.replaceChildren(view);
  if (window.parent !== window) leaveWheelToOuterPage(stage);
  return new Host(bundle, stage, view, Object.values(parts));
}

const app = document.getElementById("app");
if (app === null) throw new Error("the page has no #app");
const opened = open(app);
const ready = opened.then(({ display }) => display.overviewShown());
opened.catch((error: unknown) => {
  if (!(error instanceof BundleError)) {
    showFatal(app, "The viewer failed", String(error));
    throw error;
  }
  const isSource =
    error.name === "SourceError" || new URL(pageAddress()).searchParams.has("source");
  const kind = isSource ? "source" : "bundle";
  showFatal(app, `This ${kind} can't be shown`, error.message);
});
let host: Host | null = null;
void opened.then(
  (made) => {
    host = made;
  },
  () => undefined, // reported above
);
// a failure of the parts that load afterwards does not concern the page
void ready.then(() => host?.noteOverview()).catch(() => undefined);
watchWaiting((jobs) => host?.noteWaiting(jobs));
ready.catch(() => undefined); // reported above; a caller that awaits `ready` still gets the error

/** Reports a bug on the page; the console has the details. */
function reportBug(error: unknown): void {
  if (!(error instanceof Error)) return; // for example the harmless message of a ResizeObserver
  host?.dispatch({ type: "notify", text: `Something in the viewer failed: ${error.message}` });
}
addEventListener("error", (event) => reportBug(event.error));
addEventListener("unhandledrejection", (event) => reportBug(event.reason));

const api: StereoCellApi = {
  apiVersion: 1,
  get bench() {
    return host?.service("bench")?.report ?? null;
  },
  ready,
  get frames() {
    return host?.display.frames ?? 0;
  },
  settled: async () => (host ?? (await opened)).display.settled(),
  snapshot() {
    if (host === null) throw new Error("nothing is open yet: await ready");
    return host.display.snapshot();
  },
};
window.stereocell = api;
