/**
 * Watches the build of the page's source: shows its progress, and each newer bundle of the
 * specimen.
 */
import type { LiveHost } from "../bundle/live_host";
import { BuildFeed } from "./build_feed";
import type { BuildState } from "./build_state";
import { ViewFollower } from "./follow_views";
import { ProgressLine } from "./progress_line";

/** Time between two checks for late frames, ms; the build pauses for half a second each time. */
const LOOK_MS = 250;

export type BuildWatch = Readonly<{
  live: LiveHost;
  /** Passed to `ViewFollower`: `root`, `shown` and `show`. */
  root: string;
  shown: string;
  show: (base: string) => Promise<void>;
  /** Returns whether the view is moving and its frames are late. */
  isLate: () => boolean;
}>;

export function watchBuild({ live, root, shown, show, isLate }: BuildWatch): void {
  const views = new ViewFollower(root, shown, show, () => line.update(now, views.isNewestShown));
  const line = new ProgressLine(document.body, (command) => feed.send(command));
  let now: BuildState | null = null;
  const feed = new BuildFeed(live.socket, (state) => {
    now = state;
    if (state !== null) views.take(state);
    line.update(state, views.isNewestShown);
    if (state?.doing !== "complete" && state?.doing !== "deleted") return;
    clearInterval(looks);
    feed.dispose();
  });
  const looks = setInterval(() => {
    const mayRest = now?.mayControl === true && now.doing === "building";
    // A hidden page does not draw frames, so none can be late.
    if (mayRest && !document.hidden && isLate()) feed.rest();
  }, LOOK_MS);
}
