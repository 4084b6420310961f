/**
 * Replaces the bundle on the page by a newer one of the same specimen, while the camera and all
 * settings stay.
 */
import { element } from "../dom/element";
import type { Host } from "../host/host";
import { linkOf } from "../share/link_of";
import { settingsOf } from "../share/page_parameters";
import { readLink } from "../share/permalink";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";

/** Milliseconds between two checks whether the page may change. */
const CHECK_MS = 200;
/** Milliseconds that a page with a complete view may take at most to become sharp before it is shown. */
const SHARPEN_MS = 20_000;

let pointersDown = 0;
for (const kind of ["pointerdown", "pointerup", "pointercancel"]) {
  addEventListener(
    kind,
    () => {
      pointersDown = Math.max(0, pointersDown + (kind === "pointerdown" ? 1 : -1));
    },
    { capture: true, passive: true },
  );
}

/** Returns whether the user would notice a change: in stereo, during a drag, or while typing. */
function isInUse(host: Host): boolean {
  const { activeElement } = document;
  const isTyping = activeElement instanceof HTMLInputElement && activeElement.type === "text";
  return host.isInStereo || pointersDown > 0 || isTyping;
}

/** Resolves once the user would not notice a change. */
async function atRest(host: Host): Promise<void> {
  while (isInUse(host)) await new Promise((resolve) => setTimeout(resolve, CHECK_MS));
}

/**
 * Makes a second page behind the shown one, copies the view to it, and shows it once it is about as
 * sharp.
 *
 * @param make makes the content of a page in an element, and returns its host
 */
export async function exchange(
  before: Host,
  make: (parent: HTMLElement) => Promise<Host>,
): Promise<Host> {
  await atRest(before);
  const parent = element("div", { id: "app", className: "preparing", inert: true });
  const shown = before.view.parentElement;
  shown?.before(parent);
  let after: Host | null = null;
  try {
    after = await make(parent);
    const start = after.state;
    copyView(before, after, start);
    const isThere = after.display.overviewShown();
    const isLate = isThere.then(() => new Promise((resolve) => setTimeout(resolve, SHARPEN_MS)));
    await Promise.race([after.display.settled(), isLate]);
    await atRest(before);
    copyView(before, after, start); // includes the user's changes during the preparation
    await after.display.nextFrame();
  } catch (error) {
    after?.dispose();
    parent.remove();
    throw error;
  }
  parent.classList.remove("preparing");
  parent.inert = false;
  shown?.remove();
  before.dispose();
  return after;
}

/** Copies the state, the camera and the panel from one host to another. */
function copyView(before: Host, after: Host, start: ViewerState): void {
  const opening = settingsOf(location.search).reduce(reduce, initialState(before.bundle.manifest));
  const link = linkOf(before, opening);
  const { bounds_um } = after.bundle.manifest.specimen;
  after.dispatch({ type: "restore", state: start });
  const { actions } = readLink(link, after.state, bounds_um);
  for (const action of actions) after.dispatch(action);
  after.viewpoint.lookFrom(before.viewpoint.viewNow);
  after.panel.show(before.panel.view);
  after.undo.forget();
}
