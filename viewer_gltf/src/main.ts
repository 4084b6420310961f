/** Start: find the bundle, show it, or say on the page why not. */
import "./ui/page.css";
import "./ui/panel.css";
import "./ui/controls.css";
import "./ui/overlays.css";
import type { StereoCellApi } from "./api";
import { bundleAddress } from "./bundle/address";
import { BundleError } from "./bundle/errors";
import type { Manifest } from "./bundle/generated/bundle";
import { loadBundle } from "./bundle/load";
import { settingsOf } from "./share/settings";
import { element } from "./ui/dom";
import { Notices, ProgressBar, showFatal } from "./ui/overlays";
import { Panel } from "./ui/panel";
import { Viewer } from "./viewer";
import { findXrSupport } from "./xr/support";

function checkWebGl2(): void {
  if (document.createElement("canvas").getContext("webgl2") !== null) return;
  throw new BundleError(
    "This browser offers no WebGL 2, which the viewer draws with. Try a current Chrome, Edge, " +
      "Firefox or Safari, and check that hardware acceleration is on in its settings.",
  );
}

/** For example `512 x 205 x 54 um`. */
function describeSize({ specimen, tiles }: Manifest): string {
  const { min, max } = specimen.bounds_um;
  const edges = max.map((v, i) => (v - min[i]).toPrecision(3)).map(Number);
  return `${edges.join(" × ")} µm · ${tiles.length} ${tiles.length === 1 ? "tile" : "tiles"}`;
}

function describeStatus(viewer: Viewer): string {
  const { triangles, volumes, isLoading } = viewer.snapshot();
  const parts = [`${Math.round(triangles / 1000).toLocaleString("en")} k triangles`];
  const levels = volumes.flatMap(({ level }) => (level === null ? [] : [level]));
  if (levels.length > 0) parts.push(`volume level ${Math.min(...levels)}`);
  if (isLoading) parts.push("refining …");
  return parts.join(" · ");
}

async function open(parent: HTMLElement): Promise<Viewer> {
  checkWebGl2();
  const bundle = await loadBundle(bundleAddress(location.href));
  const { manifest } = bundle;
  document.title = `${manifest.specimen.name} · StereoCell`;

  const stage = element("div", { className: "stage" });
  const progress = new ProgressBar();
  const notices = new Notices((text) => viewer.dispatch({ type: "dismiss", text }));
  const view = element("div", { className: "view" }, {}, stage, progress.root, notices.root);
  parent.replaceChildren(view);
  const viewer: Viewer = new Viewer(
    bundle,
    stage,
    (state) => {
      panel.update(state);
      notices.update(state.notices);
    },
    () => {
      progress.update(viewer.snapshot().overview);
      panel.setStatus(describeStatus(viewer));
    },
  );
  const panel = new Panel(
    manifest.specimen.name,
    describeSize(manifest),
    viewer.state,
    (action) => viewer.dispatch(action),
    () => void enterStereo(viewer),
    () => viewer.run("reset"),
  );
  parent.append(panel.root);
  for (const action of settingsOf(location.search)) viewer.dispatch(action);
  panel.setStereo(await findXrSupport(navigator.xr, isSecureContext));
  return viewer;
}

async function enterStereo(viewer: Viewer): Promise<void> {
  if (navigator.xr === undefined) return;
  try {
    await viewer.xr.start(navigator.xr);
  } catch (error) {
    if (!(error instanceof DOMException)) throw error;
    viewer.dispatch({ type: "notify", text: `Stereo could not start: ${error.message}` });
  }
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
void opened.then(
  (made) => {
    viewer = made;
  },
  () => undefined, // told above
);
ready.catch(() => undefined); // told above; whoever awaits `ready` still sees it

/** Bugs: the console has the details, the page says that something is amiss. */
function tellBug(error: unknown): void {
  if (!(error instanceof Error)) return; // such as a ResizeObserver's harmless message
  viewer?.dispatch({ type: "notify", text: `Something in the viewer failed: ${error.message}` });
}
addEventListener("error", (event) => tellBug(event.error));
addEventListener("unhandledrejection", (event) => tellBug(event.reason));

const api: StereoCellApi = {
  apiVersion: 1,
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
