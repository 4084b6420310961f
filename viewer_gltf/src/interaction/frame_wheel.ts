/** The mouse wheel on a page that another page embeds in a frame. */

/**
 * Lets the wheel scroll the outer page until the user has clicked on the canvas. With Ctrl, or by a
 * pinch on a trackpad, it zooms at once.
 */
export function leaveWheelToOuterPage(stage: HTMLElement): void {
  stage.addEventListener(
    "wheel",
    (event) => {
      if (!document.hasFocus() && !event.ctrlKey) event.stopImmediatePropagation();
    },
    { capture: true, passive: true },
  );
}
