/** Calls back when the stage has another size, or its window another pixel ratio. */
export class StageSize {
  private readonly observer: ResizeObserver;
  private readonly disposed = new AbortController();

  constructor(
    stage: HTMLElement,
    private readonly onChange: () => void,
  ) {
    this.observer = new ResizeObserver(onChange);
    this.observer.observe(stage);
    this.listen();
  }

  /** A window may go to another screen, or be zoomed, at the same size. */
  private listen(): void {
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener(
      "change",
      () => {
        this.onChange();
        this.listen();
      },
      { once: true, signal: this.disposed.signal },
    );
  }

  dispose(): void {
    this.observer.disconnect();
    this.disposed.abort();
  }
}
