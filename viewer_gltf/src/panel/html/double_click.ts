/**
 * Ignores the second click of a double click. It is not a second request: it would switch a control
 * back, or press a control that the first click has moved under the pointer. Controls with
 * `data-step` move on by a step and take every click.
 */

/** Stops the second click of a double click, as the browser counts clicks, on all children of an element. */
export function ignoreSecondClicks(root: HTMLElement): void {
  let stepped: Element | null = null;
  const onClick = (event: MouseEvent) => {
    const step = event.target instanceof Element ? event.target.closest("[data-step]") : null;
    const isSecond = event.detail > 1 && (step === null || step !== stepped);
    if (event.detail < 2) stepped = step;
    if (!isSecond) return;
    event.preventDefault();
    event.stopPropagation();
  };
  root.addEventListener("click", onClick, { capture: true });
}
