/**
 * The second click of a double click is no second wish: it would switch a control back, or choose what has
 * come under the pointer by the first. Controls that go on by a step, `data-step`, take each click.
 */

/** Keep the second click of a double click, as the browser counts them, from what lies in an element. */
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
