/** Offers a reload with fewer pixels if the graphics driver does not restore a lost context. */
import "./lost_context.css";
import { element } from "../dom/element";
import { DROPPED } from "../host/faults";
import type { PartHost } from "../host/part";
import { halvePixelShare } from "../render/pixel_share";

/** Milliseconds until the page offers a reload. Most drivers restore the context within a second. */
const PATIENCE_MS = 5000;
const LOST = "The graphics driver has dropped the view and has not restored it.";
const OFFER = "Reload with fewer pixels";

/**
 * Offers the reload after some time. The offer disappears if the context is restored.
 *
 * @param beforeReload called before the reload, to save the view
 */
export function offerReload(host: PartHost, beforeReload: () => void): void {
  const reload = () => {
    beforeReload();
    halvePixelShare();
    location.reload();
  };
  const card = element(
    "div",
    { className: "lost-context", role: "alert" },
    { lost: "" },
    element("p", { textContent: LOST }),
    element("button", { textContent: OFFER, onclick: reload }, { action: "reload" }),
  );
  // the stage covers the whole page in the split screen
  const timer = setTimeout(() => {
    host.stage.append(card);
    host.dispatch({ type: "dismiss", texts: [DROPPED] });
  }, PATIENCE_MS);
  const onRestored = () => {
    clearTimeout(timer);
    card.remove();
  };
  host.canvas.addEventListener("webglcontextrestored", onRestored, { once: true });
}
