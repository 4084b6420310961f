/** Start: find the bundle, show it, or report on the page why not. */
import "../panel/html/page.css";
import "../panel/html/panel.css";
import "../panel/html/widgets.css";
import "../panel/html/controls.css";
import "../panel/html/overlays.css";
import "../panel/html/forced_colors.css";
import "../annotations/annotations.css";
import { bundleAddress, pageAddress } from "../bundle/address";
import { BundleError } from "../bundle/errors";
import { fileAddress } from "../bundle/fetch";
import type { Manifest } from "../bundle/generated/bundle";
import { type Bundle, loadBundle } from "../bundle/load";
import { watchWaiting } from "../bundle/retry";
import { element } from "../dom/element";
import { hasFullScreen } from "../dom/full_screen";
import { leaveWheelToHolder } from "../interaction/frame_wheel";
import { isKept } from "../offline/request_plan";
import { FirstHint, Notices, ProgressBar, Said, showFatal, WayBack } from "../panel/html/overlays";
import { opensAr, WaysIn } from "../panel/html/ways_in";
import { sizeText } from "../probe/measure";
import type { Theme } from "../render/theme";
import { flightAsked } from "../share/bench_parameter";
import { isLight, isPlain, panelOf } from "../share/page_parameters";
import { CARDBOARD_V2 } from "../xr/cardboard/viewer_profile";
import type { ImmersiveMode } from "../xr/session";
import { findXrSupport, showsUsersRoom, wayToStereo } from "../xr/support";
import type { Opened } from "./address_bar";
import type { StereoCellApi } from "./automation_api";
import { Controller } from "./controller";
import type { Later } from "./later_parts";
import type { NotebookPart } from "./notebook_part";
import { Viewer } from "./viewer";

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

/** What is kept for a visit without a network, though the page itself does not fetch it. */
function alsoKept({ bundle }: Viewer): readonly string[] {
  const usdz = usdzFor(bundle);
  return usdz !== null && isKept(bundle.manifest.usdz ?? null) ? [usdz] : [];
}

const LIGHT = matchMedia("(prefers-color-scheme: light)");
const CONTRAST = matchMedia("(prefers-contrast: more)");

/** The page's colours, as the address or the system has them. */
function dressPage(): Theme {
  const theme = isLight(new URL(pageAddress()).search, LIGHT.matches) ? "light" : "dark";
  document.documentElement.dataset.theme = theme;
  return theme;
}

/** The background of the picture, too; a system's colours may change by night. */
function followSystem(viewer: Viewer, search: string): void {
  const dress = () => viewer.dress(dressPage(), isPlain(search, CONTRAST.matches));
  for (const query of [LIGHT, CONTRAST]) query.addEventListener("change", dress);
  dress();
}

async function open(parent: HTMLElement): Promise<Viewer> {
  dressPage();
  checkWebGl2();
  sayAtStart("Reading the bundle");
  const page = pageAddress();
  const bundle = await loadBundle(bundleAddress(page));
  const { manifest } = bundle;
  document.title = `${manifest.specimen.name} · StereoCell`;

  const stage = element("div", { className: "stage" });
  stage.ariaLabel = "The specimen: the arrow keys turn it, ? lists all keys";
  stage.role = "group"; // an image would hide the marks and the buttons in it from screen readers
  const progress = new ProgressBar();
  const notices = new Notices(
    (texts) => viewer.dispatch({ type: "dismiss", texts }),
    () => viewer.run("retry"),
  );
  const waysIn = new WaysIn();
  const isTouch = matchMedia("(pointer: coarse)").matches;
  const isFramed = window.parent !== window;
  const hint = new FirstHint(isTouch, isFramed);
  const wayBack = new WayBack(() => viewer.run("back"));
  const over = [hint.root, progress.root, said.root, notices.root, waysIn.root, wayBack.root];
  parent.replaceChildren(element("main", { className: "view" }, {}, stage, ...over));
  let controller: Controller | null = null;
  let notebook: NotebookPart | null = null;
  if (isFramed) leaveWheelToHolder(stage);
  const { search, hash } = new URL(page);
  document.documentElement.dataset.panel = panelOf(search);
  const viewer: Viewer = new Viewer(
    bundle,
    stage,
    (state) => {
      controller?.refresh();
      notices.update(state);
      hint.update(state);
      wayBack.update(state);
      notebook?.note();
    },
    () => {
      progress.update(viewer.snapshot().overview);
      controller?.refreshSoon();
      notebook?.note();
    },
  );
  followSystem(viewer, search);
  controller = new Controller(viewer, parent, said, {
    subtitle: describeSize(manifest),
    onStereo: () => void enterStereo(viewer, "immersive-vr"),
    onRoom: () => void enterStereo(viewer, "immersive-ar"),
    onSplit: (lenses) => void viewer.startSplit(lenses).catch((error) => viewer.report(error)),
  });
  const { layOut } = controller;
  viewer.layOut = layOut.bind(controller);
  notices.update(viewer.state);
  controller.followAddress(search, hash);
  openedAs = { state: viewer.state, camera: viewer.cameraView };
  viewer.renderer.domElement.addEventListener("webglcontextlost", () => {
    void import("./lost_context").then(({ offerReload }) =>
      offerReload(viewer, () => later?.addressBar?.write()),
    );
  });
  hint.update(viewer.state);
  whenTouched(() => {
    viewer.stopTurning();
    hint.leave();
  });
  const support = await findXrSupport(navigator.xr, isSecureContext);
  const hasRoom = await showsUsersRoom(navigator.xr, isSecureContext);
  controller.setStereo(support, hasRoom);
  const way = wayToStereo(support, isTouch);
  waysIn.offerStereo(way, () => way && controller.perform(way));
  if (way !== null || hasRoom) void prepareStereo(viewer);
  if (hasFullScreen()) waysIn.offerFullScreen(() => controller.perform("full-screen"));
  if (hasRoom) waysIn.offerRoom(() => controller.perform("room"));
  const usdz = usdzFor(bundle);
  if (usdz !== null) waysIn.offerLink(usdz);
  const port = globalThis.stereocellHost?.port;
  if (port !== undefined) {
    const part = await import("./notebook_part");
    notebook = new part.NotebookPart(viewer, port);
  } else if (isFramed && new URLSearchParams(search).has("embed")) {
    const [part, way] = await Promise.all([import("./notebook_part"), import("./frame_port")]);
    const port = way.portToHolder(search, manifest);
    if (port !== null) notebook = new part.NotebookPart(viewer, port);
  }
  const flight_s = flightAsked(search);
  if (flight_s !== null) await offerBench(viewer, parent, flight_s, support.isAvailable);
  return viewer;
}

/** The benchmark, a part of the page that few ask for. */
async function offerBench(
  viewer: Viewer,
  parent: HTMLElement,
  flight_s: number,
  hasHeadset: boolean,
): Promise<void> {
  const [{ benchCard }, { subjectOf }] = await Promise.all([
    import("../bench/bench_card"),
    import("./bench_subject"),
  ]);
  const card = benchCard(flight_s, {
    subject: subjectOf(viewer),
    stereo: hasHeadset ? ["headset", "split"] : ["split"],
    startStereo: async (kind) => {
      if (kind === "split") await viewer.startSplit(CARDBOARD_V2);
      else if (navigator.xr !== undefined) await viewer.stereo.startHeadset(navigator.xr);
    },
    onReport: (report) => {
      api.bench = report;
    },
  });
  parent.append(card);
}

async function enterStereo(viewer: Viewer, mode: ImmersiveMode): Promise<void> {
  if (navigator.xr === undefined) return;
  try {
    await viewer.stereo.startHeadset(navigator.xr, mode);
  } catch (error) {
    if (!(error instanceof DOMException || error instanceof BundleError)) throw error;
    viewer.dispatch({ type: "notify", text: `Stereo could not start: ${error.message}` });
  }
}

/** Load the part of the page that shows stereo, once there is a picture and the page has nothing else to do. */
async function prepareStereo(viewer: Viewer): Promise<void> {
  await overviewShown(viewer);
  const prepare = () => void viewer.stereo.prepare().catch(() => undefined); // a start reports it
  if (typeof requestIdleCallback === "function") requestIdleCallback(prepare);
  else setTimeout(prepare, AFTER_PICTURE_MS);
}

/** Resolves once every shown channel's overview is on screen. */
async function overviewShown(viewer: Viewer): Promise<void> {
  for (;;) {
    const before = viewer.frames;
    if (viewer.snapshot().overview.isComplete && before > 0) return;
    await new Promise((resolve) => requestAnimationFrame(resolve));
  }
}

const app = document.getElementById("app");
if (app === null) throw new Error("the page has no #app");
const opened = open(app);
const ready = opened.then(overviewShown);
opened.catch((error: unknown) => {
  if (!(error instanceof BundleError)) {
    showFatal(app, "The viewer failed", String(error));
    throw error;
  }
  showFatal(app, "This bundle can't be shown", error.message);
});
let viewer: Viewer | null = null;
let later: Later | null = null;
void opened.then(
  (made) => {
    viewer = made;
  },
  () => undefined, // reported above
);
void ready
  .then(async () => {
    const { startLater } = await import("./later_parts");
    if (viewer === null || openedAs === null) return;
    later = startLater(viewer, openedAs, (text) => said.say(text), alsoKept(viewer));
  })
  .catch(() => undefined); // without these parts the page shows all the same
watchWaiting((jobs) => viewer?.noteWaiting(jobs));
ready.catch(() => undefined); // reported above; a caller that awaits `ready` still sees it

/** Bugs: the console has the details, the page reports that something is amiss. */
function reportBug(error: unknown): void {
  if (!(error instanceof Error)) return; // such as a ResizeObserver's harmless message
  viewer?.dispatch({ type: "notify", text: `Something in the viewer failed: ${error.message}` });
}
addEventListener("error", (event) => reportBug(event.error));
addEventListener("unhandledrejection", (event) => reportBug(event.reason));

const api: StereoCellApi = {
  apiVersion: 1,
  bench: null,
  ready,
  get frames() {
    return viewer?.frames ?? 0;
  },
  settled: async () => (await opened).settled(),
  snapshot() {
    if (viewer === null) throw new Error("nothing is open yet: await ready");
    return viewer.snapshot();
  },
};
window.stereocell = api;
