/** Watches the build behind the page: shows how far it is, and each newer view of the specimen. */
import type { LiveHost } from "../bundle/live_host";
import { BuildFeed } from "./build_feed";
import type { BuildState } from "./build_state";
import { ViewFollower } from "./follow_views";
import { ProgressLine } from "./progress_line";

/** Time between two looks whether frames are late, ms; the build rests for half a second each time. */
const LOOK_MS = 250;

export type BuildWatch = Readonly<{
  live: LiveHost;
  /** Those of `ViewFollower`. */
  root: string;
  shown: string;
  show: (base: string) => Promise<void>;
  /** Whether the picture moves now, and its frames are late. */
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
    // a hidden page draws no frame that could be late
    if (mayRest && !document.hidden && isLate()) feed.rest();
  }, LOOK_MS);
}
