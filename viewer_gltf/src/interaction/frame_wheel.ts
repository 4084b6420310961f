/** The wheel in a page that another one holds in a frame. */

/**
 * Until somebody has clicked here the wheel scrolls the page around, as it does over any picture; with Ctrl, and by
 * a pinch on a trackpad, it zooms at once.
 */
export function leaveWheelToHolder(stage: HTMLElement): void {
  stage.addEventListener(
    "wheel",
    (event) => {
      if (!document.hasFocus() && !event.ctrlKey) event.stopImmediatePropagation();
    },
    { capture: true, passive: true },
  );
}
