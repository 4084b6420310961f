/**
 * Makes many buttons one stop of the Tab key. The arrow keys move between them, in rows of
 * `columns` (the "roving tabindex" of the ARIA Authoring Practices Guide).
 */
export class RovingTabindex {
  private buttons: readonly HTMLElement[] = [];
  private columns = 1;

  constructor(root: HTMLElement) {
    root.addEventListener("keydown", (event) => {
      const at = this.buttons.indexOf(event.target as HTMLElement);
      const next = at === -1 ? null : this.next(event.key, at);
      if (next === null) return;
      event.preventDefault();
      this.stopAt(next);
      this.buttons[next].focus();
    });
    root.addEventListener("focusin", (event) => {
      const at = this.buttons.indexOf(event.target as HTMLElement);
      if (at !== -1) this.stopAt(at);
    });
  }

  /** @param start index of the first button that Tab reaches */
  setButtons(buttons: readonly HTMLElement[], columns: number, start = 0): void {
    this.buttons = buttons;
    this.columns = columns;
    this.stopAt(Math.max(0, start));
  }

  private next(key: string, at: number): number | null {
    const last = this.buttons.length - 1;
    const steps: Readonly<Record<string, number>> = {
      ArrowLeft: at - 1,
      ArrowRight: at + 1,
      ArrowUp: at - this.columns,
      ArrowDown: at + this.columns,
      Home: 0,
      End: last,
    };
    const next = steps[key];
    if (next === undefined) return null;
    return next < 0 || next > last ? at : next;
  }

  private stopAt(index: number): void {
    this.buttons.forEach((each, i) => {
      each.tabIndex = i === index ? 0 : -1;
    });
  }
}
