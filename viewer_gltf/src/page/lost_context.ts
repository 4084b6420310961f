/** The graphics driver has dropped the picture: where it does not come back, a reload with fewer pixels may do. */
import "./lost_context.css";
import { element } from "../dom/element";
import { DROPPED } from "../host/faults";
import type { PartHost } from "../host/part";
import { halvePixelShare } from "../render/pixel_share";

/** Time until the page offers a reload, ms: most drivers are back within a second. */
const PATIENCE_MS = 5000;
const LOST = "The graphics driver has dropped the picture and does not give it back.";
const OFFER = "Reload with fewer pixels";

/**
 * Offer the reload once the driver has had its time. The offer goes when the picture comes back.
 *
 * @param beforeReload called before the page is loaded again, to keep the view
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
  // in the stage, which covers the whole page in the split screen
  const timer = setTimeout(() => {
    host.stage.append(card);
    host.dispatch({ type: "dismiss", texts: [DROPPED] });
  }, PATIENCE_MS);
  const come = () => {
    clearTimeout(timer);
    card.remove();
  };
  host.canvas.addEventListener("webglcontextrestored", come, { once: true });
}
