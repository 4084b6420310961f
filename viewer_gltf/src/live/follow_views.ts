/**
 * Shows the newest view of a source while the source is built. A view is a bundle of what is
 * finished so far. Views open one after the other.
 */
import type { BuildState } from "./build_state";

/** Time after which a view that could not be shown is tried again, ms. */
const AGAIN_MS = 3000;

export class ViewFollower {
  private newest: string;
  private isShowing = false;

  /**
   * @param root the page's own folder
   * @param shown the address of the view that the page shows; empty for the first one, which is at the root
   * @param show opens another view in its place; it may wait for a moment at which the change does not disturb
   * @param onShown called after another view has opened
   */
  constructor(
    private readonly root: string,
    private shown: string,
    private readonly show: (base: string) => Promise<void>,
    private readonly onShown: () => void = () => undefined,
    private readonly again_ms = AGAIN_MS,
  ) {
    this.newest = shown;
  }

  /** Whether the page shows the newest view. */
  get isNewestShown(): boolean {
    return this.newest === this.shown;
  }

  take({ hasBundle, folder }: Pick<BuildState, "hasBundle" | "folder">): void {
    if (hasBundle) this.newest = this.root;
    else if (folder !== "") this.newest = new URL(folder, this.root).href;
    void this.follow();
  }

  private async follow(): Promise<void> {
    if (this.isShowing) return;
    this.isShowing = true;
    while (this.newest !== this.shown) {
      const next = this.newest;
      try {
        await this.show(next);
        this.shown = next;
        this.onShown();
      } catch {
        await new Promise((resolve) => setTimeout(resolve, this.again_ms)); // the server may answer again after the pause
      }
    }
    this.isShowing = false;
  }
}
