/** Watches the build behind the page: shows how far it is, and each newer view of the specimen. */
import type { LiveHost } from "../bundle/live_host";
import { BuildFeed } from "./build_feed";
import { ViewFollower } from "./follow_views";
import { ProgressLine } from "./progress_line";

/** The addresses and `show` are those of `ViewFollower`. */
export function watchBuild(
  live: LiveHost,
  root: string,
  shown: string,
  show: (base: string) => Promise<void>,
): void {
  const views = new ViewFollower(root, shown, show);
  const line = new ProgressLine(document.body, (command) => feed.send(command));
  const feed = new BuildFeed(live.socket, (state) => {
    line.update(state);
    if (state !== null) views.take(state);
    if (state?.doing === "complete" || state?.doing === "deleted") feed.dispose();
  });
}
