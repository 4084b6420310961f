/** Watches the build behind the page: shows how far it is, and asks for each newer view of the specimen. */
import type { LiveHost } from "../bundle/live_host";
import { BuildFeed } from "./build_feed";
import type { BuildState } from "./build_state";
import { ProgressLine } from "./progress_line";

/** Time after which a view that could not be shown is tried again, ms. */
const AGAIN_MS = 3000;

/**
 * @param root the page's own folder
 * @param shown the address of the view that the page shows; empty: the first one, which the root leads to
 * @param show puts another view in its place; it may wait until nobody would notice
 */
export function watchBuild(
  live: LiveHost,
  root: string,
  shown: string,
  show: (base: string) => Promise<void>,
): void {
  let newest: string = shown;
  let isShowing = false;
  const line = new ProgressLine((command) => feed.send(command));
  document.body.append(line.root);

  /** One view at a time, and always the newest. */
  const follow = async () => {
    if (isShowing || newest === shown) return;
    isShowing = true;
    const next = newest;
    try {
      await show(next);
      shown = next;
    } catch {
      await new Promise((resolve) => setTimeout(resolve, AGAIN_MS)); // the server may be back by then
    }
    isShowing = false;
    void follow();
  };

  const feed = new BuildFeed(live.socket, (state: BuildState | null) => {
    line.update(state);
    if (state === null) return;
    if (state.hasBundle) newest = root;
    else if (state.folder !== "") newest = new URL(state.folder, root).href;
    void follow();
    if (state.doing === "complete") feed.dispose();
  });
}
