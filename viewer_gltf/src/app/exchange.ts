/** Puts a newer view of the same specimen in the place of the one that the page shows, without a jump. */
import { element } from "../dom/element";
import type { Host } from "../host/host";
import { linkOf } from "../share/link_of";
import { settingsOf } from "../share/page_parameters";
import { readLink } from "../share/permalink";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";

/** Time between two looks at whether the page may change, ms. */
const LOOK_MS = 200;
/** Longest time that a page whose picture is there is prepared for what would make it sharper, ms. */
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

/** Whether someone would notice: in stereo, while a pointer drags, while a text is written. */
function isInHand(host: Host): boolean {
  const { activeElement } = document;
  const writes = activeElement instanceof HTMLInputElement && activeElement.type === "text";
  return host.isInRoom || pointersDown > 0 || writes;
}

/** Resolves once nobody would notice a change. */
async function atRest(host: Host): Promise<void> {
  while (isInHand(host)) await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
}

/**
 * Makes a second page behind the shown one, brings it to the same view, and shows it once its picture is as
 * sharp, or nearly.
 *
 * @param make makes a page's content in an element, and returns its host
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
    carry(before, after, start);
    const isThere = after.display.overviewShown();
    const isLate = isThere.then(() => new Promise((resolve) => setTimeout(resolve, SHARPEN_MS)));
    await Promise.race([after.display.settled(), isLate]);
    await atRest(before);
    carry(before, after, start); // what the user did meanwhile
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

/** Brings a host to the state, the camera and the panel of another one. */
function carry(before: Host, after: Host, start: ViewerState): void {
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
