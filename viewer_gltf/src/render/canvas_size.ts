/**
 * Calls back when the canvas's container changes its size, or its window changes its pixel ratio.
 */
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

  /**
   * The pixel ratio can change without the size: when the window moves to another screen or is
   * zoomed.
   */
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
