/** Start: find the bundle, show it, or report on the page why not. */
import "../panel/html/page.css";
import "../panel/html/panel.css";
import "../panel/html/widgets.css";
import "../panel/html/controls.css";
import "../panel/html/overlays.css";
import "../panel/html/forced_colors.css";
import { bundleAddress, namesBundle, pageAddress, sourceAddress } from "../bundle/address";
import { BundleError, MissingError } from "../bundle/errors";
import { fileAddress } from "../bundle/fetch";
import type { Manifest } from "../bundle/generated/bundle";
import { isHeld } from "../bundle/held_files";
import { type Bundle, loadBundle } from "../bundle/load";
import { watchWaiting } from "../bundle/retry";
import { element } from "../dom/element";
import { hasFullScreen } from "../dom/full_screen";
import { Host } from "../host/host";
import { leaveWheelToHolder } from "../interaction/frame_wheel";
import { isKept } from "../offline/request_plan";
import { Page } from "../page/page";
import { FirstHint, Notices, ProgressBar, Said, showFatal, WayBack } from "../panel/html/overlays";
import { opensAr, WaysIn } from "../panel/html/ways_in";
import { sizeText } from "../probe/measure";
import type { Theme } from "../render/theme";
import { withTyped } from "../share/address";
import type { Opened } from "../share/address_bar";
import { flightAsked } from "../share/bench_parameter";
import { loadLink, openAddress } from "../share/open_address";
import { isLight, isPlain, panelOf } from "../share/page_parameters";
import type { ShownSource } from "../source/open_source";
import type { XrSupport } from "../state/stereo";
import { startSplit } from "../stereo/start_split";
import { CARDBOARD_V2 } from "../xr/cardboard/viewer_profile";
import { findXrSupport, showsUsersRoom, wayToStereo } from "../xr/support";
import type { StereoCellApi } from "./automation_api";
import type { Later } from "./later_parts";
import * as parts from "./parts";

/** Time after the first picture until stereo is prepared, where the browser does not report idle time, ms. */
const AFTER_PICTURE_MS = 2000;

function checkWebGl2(): void {
  if (document.createElement("canvas").getContext("webgl2") !== null) return;
  throw new BundleError(
    "This browser offers no WebGL 2, which the viewer draws with. Try a current Chrome, Edge, " +
      "Firefox or Safari, and check that hardware acceleration is on in its settings.",
  );
}

/** For example `512 x 205 x 54 um`, or `231 x 215 x 255 mm`. */
function describeSize({ specimen, tiles }: Manifest): string {
  const { min, max } = specimen.bounds_um;
  return `${sizeText(max.map((v, i) => v - min[i]))} · ${tiles.length} ${tiles.length === 1 ? "tile" : "tiles"}`;
}

const said = new Said();
/** The view that the address has opened. */
let openedAs: Opened | null = null;

/** On the page that stands until there is a picture: see boot/. */
function sayAtStart(text: string): void {
  const words = document.querySelector("[data-boot] p");
  if (words !== null) words.textContent = text;
}

/** Once: someone has taken the page in hand. */
function whenTouched(then: () => void): void {
  const touched = new AbortController();
  const options = { capture: true, passive: true, signal: touched.signal };
  const touch = () => {
    touched.abort();
    then();
  };
  for (const kind of ["pointerdown", "wheel", "keydown"]) addEventListener(kind, touch, options);
}

/** Address of the file that this device shows in the user's room; null: it shows none. */
function usdzFor({ base, manifest }: Bundle): string | null {
  const usdz = manifest.usdz ?? null;
  return usdz !== null && opensAr() ? fileAddress(base, usdz.path) : null;
}

/** Files that are kept for a visit without a network, though the page itself does not fetch them. */
function alsoKept({ bundle }: Host): readonly string[] {
  const usdz = usdzFor(bundle);
  return usdz !== null && isKept(bundle.manifest.usdz ?? null) ? [usdz] : [];
}

const LIGHT = matchMedia("(prefers-color-scheme: light)");
const CONTRAST = matchMedia("(prefers-contrast: more)");
const IS_TOUCH = matchMedia("(pointer: coarse)").matches;

/** The page's colours, as the address or the system has them. */
function dressPage(): Theme {
  const theme = isLight(new URL(pageAddress()).search, LIGHT.matches) ? "light" : "dark";
  document.documentElement.dataset.theme = theme;
  return theme;
}

/** The background of the picture, too; a system's colours may change by night. */
function followSystem(host: Host, search: string): void {
  const dress = () => host.dress(dressPage(), isPlain(search, CONTRAST.matches));
  for (const query of [LIGHT, CONTRAST]) query.addEventListener("change", dress);
  dress();
}

async function open(parent: HTMLElement): Promise<Host> {
  dressPage();
  checkWebGl2();
  const page = pageAddress();
  const { search, hash } = new URL(page);
  const [{ bundle, notes }, readLink] = await Promise.all([
    openShown(parent, page),
    loadLink(withTyped(hash)),
  ]);
  document.title = `${bundle.manifest.specimen.name} · StereoCell`;
  const isFramed = window.parent !== window;
  document.documentElement.dataset.panel = panelOf(search);

  const { host, waysIn, hint } = makeHost(parent, bundle, isFramed);
  followSystem(host, search);
  host.panel.learn({ subtitle: describeSize(bundle.manifest) });
  const ofPage = new Page(host, parent, said);
  host.add(ofPage);
  for (const text of notes) host.dispatch({ type: "notify", text }, false);
  if (isHeld(bundle.base)) {
    const { refuseDrops } = await import("../source/dropped");
    refuseDrops((text) => said.say(text));
  }
  openAddress(host, search, readLink);
  const { viewpoint, renderer } = host.display;
  openedAs = { state: host.state, camera: viewpoint.cameraView };
  renderer.domElement.addEventListener("webglcontextlost", () => {
    void import("../page/lost_context").then(({ offerReload }) =>
      offerReload(host, () => later?.addressBar?.write()),
    );
  });
  hint.update(host.state);
  whenTouched(() => {
    viewpoint.stopTurning();
    hint.leave();
  });
  const support = await offerWaysIn(host, waysIn, ofPage);
  await addHolder(host, search, isFramed);
  const flight_s = flightAsked(search);
  if (flight_s !== null) await offerBench(host, parent, flight_s, support.isAvailable);
  return host;
}

/** What the address names: a bundle, or a source that the page reads by itself. Without either a person chooses one. */
async function openShown(parent: HTMLElement, page: string): Promise<ShownSource> {
  const source = sourceAddress(page);
  if (source !== null) {
    sayAtStart("Reading the source");
    const { openAddress } = await import("../source/open_source");
    return openAddress(source, sayAtStart);
  }
  sayAtStart("Reading the bundle");
  try {
    return { bundle: await loadBundle(bundleAddress(page)), notes: [] };
  } catch (error) {
    if (!(error instanceof MissingError) || namesBundle(page)) throw error;
    const { chooseSource } = await import("../source/start_page");
    return chooseSource(parent);
  }
}

/** The host, with the picture and all that lies over it. */
function makeHost(parent: HTMLElement, bundle: Bundle, isFramed: boolean) {
  const stage = element("div", { className: "stage" });
  stage.ariaLabel = "The specimen: the arrow keys turn it, ? lists all keys";
  stage.role = "group"; // an image would hide the marks and the buttons in it from screen readers
  const progress = new ProgressBar();
  const notices = new Notices(
    (texts) => host.dispatch({ type: "dismiss", texts }),
    () => host.run("retry"),
  );
  const waysIn = new WaysIn();
  const hint = new FirstHint(IS_TOUCH, isFramed);
  const wayBack = new WayBack(() => host.run("back"));
  const over = [hint.root, progress.root, said.root, notices.root, waysIn.root, wayBack.root];
  const view = element("main", { className: "view" }, {}, stage, ...over);
  parent.replaceChildren(view);
  if (isFramed) leaveWheelToHolder(stage);
  const host: Host = new Host(bundle, stage, view, Object.values(parts));
  host.changed.subscribe((state) => {
    for (const each of [notices, hint, wayBack]) each.update(state);
  });
  host.drawn.subscribe(() => progress.update(host.display.snapshot().overview));
  notices.update(host.state);
  return { host, waysIn, hint };
}

/** Offers the ways into stereo, the user's room and the full screen that this device has. */
async function offerWaysIn(host: Host, waysIn: WaysIn, page: Page): Promise<XrSupport> {
  const support = await findXrSupport(navigator.xr, isSecureContext);
  const hasRoom = await showsUsersRoom(navigator.xr, isSecureContext);
  host.panel.learn({ stereo: support, hasRoom });
  const way = wayToStereo(support, IS_TOUCH);
  waysIn.offerStereo(way, () => way && page.perform(way));
  if (way !== null || hasRoom) void prepareStereo(host);
  if (hasFullScreen()) waysIn.offerFullScreen(() => page.perform("full-screen"));
  if (hasRoom) waysIn.offerRoom(() => page.perform("room"));
  const usdz = usdzFor(host.bundle);
  if (usdz !== null) waysIn.offerLink(usdz);
  return support;
}

/** Shares the view with the notebook, or with the page that holds this one in a frame. */
async function addHolder(host: Host, search: string, isFramed: boolean): Promise<void> {
  const port = globalThis.stereocellHost?.port;
  if (port !== undefined) {
    const { NotebookPart } = await import("../notebook/notebook_part");
    host.add(new NotebookPart(host, port));
  } else if (isFramed && new URLSearchParams(search).has("embed")) {
    const [{ NotebookPart }, way] = await Promise.all([
      import("../notebook/notebook_part"),
      import("../notebook/frame_port"),
    ]);
    const port = way.portToHolder(search, host.bundle.manifest);
    if (port !== null) host.add(new NotebookPart(host, port));
  }
}

/** The benchmark, a part of the page that few ask for. */
async function offerBench(
  host: Host,
  parent: HTMLElement,
  flight_s: number,
  hasHeadset: boolean,
): Promise<void> {
  const [{ benchCard }, { subjectOf }] = await Promise.all([
    import("../bench/bench_card"),
    import("../bench/bench_subject"),
  ]);
  const { stereo } = host.display;
  const card = benchCard(flight_s, {
    subject: subjectOf(host),
    stereo: hasHeadset ? ["headset", "split"] : ["split"],
    startStereo: async (kind) => {
      if (kind === "split") await startSplit(host, CARDBOARD_V2);
      else if (navigator.xr !== undefined) await stereo.startHeadset(navigator.xr);
    },
    onReport: (report) => {
      api.bench = report;
    },
  });
  parent.append(card);
}

/** Load the part of the page that shows stereo, once there is a picture and the page has nothing else to do. */
async function prepareStereo({ display }: Host): Promise<void> {
  await overviewShown(display);
  const prepare = () => void display.stereo.prepare().catch(() => undefined); // a start reports it
  if (typeof requestIdleCallback === "function") requestIdleCallback(prepare);
  else setTimeout(prepare, AFTER_PICTURE_MS);
}

/** Resolves once every shown channel's overview is on screen. */
async function overviewShown(display: Host["display"]): Promise<void> {
  for (;;) {
    const before = display.frames;
    if (display.snapshot().overview.isComplete && before > 0) return;
    await new Promise((resolve) => requestAnimationFrame(resolve));
  }
}

const app = document.getElementById("app");
if (app === null) throw new Error("the page has no #app");
const opened = open(app);
const ready = opened.then(({ display }) => overviewShown(display));
opened.catch((error: unknown) => {
  if (!(error instanceof BundleError)) {
    showFatal(app, "The viewer failed", String(error));
    throw error;
  }
  const kind = error.name === "SourceError" ? "source" : "bundle";
  showFatal(app, `This ${kind} can't be shown`, error.message);
});
let host: Host | null = null;
let later: Later | null = null;
void opened.then(
  (made) => {
    host = made;
  },
  () => undefined, // reported above
);
void ready
  .then(async () => {
    const { startLater } = await import("./later_parts");
    if (host === null || openedAs === null) return;
    later = startLater(host, openedAs, (text) => said.say(text), alsoKept(host));
  })
  .catch(() => undefined); // without these parts the page shows all the same
watchWaiting((jobs) => host?.noteWaiting(jobs));
ready.catch(() => undefined); // reported above; a caller that awaits `ready` still sees it

/** Bugs: the console has the details, the page reports that something is amiss. */
function reportBug(error: unknown): void {
  if (!(error instanceof Error)) return; // such as a ResizeObserver's harmless message
  host?.dispatch({ type: "notify", text: `Something in the viewer failed: ${error.message}` });
}
addEventListener("error", (event) => reportBug(event.error));
addEventListener("unhandledrejection", (event) => reportBug(event.reason));

const api: StereoCellApi = {
  apiVersion: 1,
  bench: null,
  ready,
  get frames() {
    return host?.display.frames ?? 0;
  },
  settled: async () => (await opened).display.settled(),
  snapshot() {
    if (host === null) throw new Error("nothing is open yet: await ready");
    return host.display.snapshot();
  },
};
window.stereocell = api;
