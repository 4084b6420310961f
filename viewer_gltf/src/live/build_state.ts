/**
 * The state of the build whose intermediate bundles (views) the page shows, as reported by the
 * server. Pure.
 */

import { BUILD_STATES } from "../bundle/generated/build_states";

export type BuildState = Readonly<{
  doing: (typeof BUILD_STATES)[number];
  /** The running part of the build, such as `units`, and its progress; empty if the build has not begun. */
  label: string;
  done: number;
  total: number;
  /** Number of tiles whose surfaces are finished, and of all tiles. */
  tiles: number;
  allTiles: number;
  /** How much of the build is done, 0..1. */
  share: number;
  /** Remaining time, s; null if unknown. */
  left_s: number | null;
  /**
   * The folder of the newest intermediate bundle (view), below the page; empty if it is the page's
   * own folder.
   */
  folder: string;
  /** Whether the bundle is complete; the page's own address then leads to it. */
  hasBundle: boolean;
  /** The reason why the build has failed; otherwise empty. */
  line: string;
  /** Place in the queue of builds, from 1; 0 if the build is not waiting. */
  place: number;
  mayControl: boolean;
  /** Whether a cancelled or failed build can continue. */
  mayContinue: boolean;
}>;

/** Reads a message of the server; null if this page does not know its form. */
export function readBuildState(text: string): BuildState | null {
  let found: Record<string, unknown>;
  try {
    found = JSON.parse(text);
  } catch {
    return null;
  }
  const doing = BUILD_STATES.find((each) => each === found?.doing);
  if (doing === undefined) return null;
  const number = (name: string) => Number(found[name]) || 0;
  const words = (name: string) => String(found[name] ?? "");
  return {
    doing,
    label: words("label"),
    done: number("done"),
    total: number("total"),
    tiles: number("tiles"),
    allTiles: number("all_tiles"),
    share: Math.min(1, Math.max(0, number("share"))),
    left_s: typeof found.left_s === "number" ? found.left_s : null,
    folder: /^g\d+\/$/.test(words("folder")) ? words("folder") : "",
    hasBundle: found.has_bundle === true,
    line: words("line"),
    place: Math.max(0, number("place")),
    mayControl: found.may_control === true,
    mayContinue: found.may_continue === true,
  };
}

/** Names of the parts of a build, for users. */
const PARTS: Readonly<Record<string, string>> = {
  windows: "Finding windows",
  evidence: "Looking for surfaces",
  components: "Choosing surfaces",
  objects: "Finding objects",
  units: "Building surfaces",
  stage: "Writing the stage",
  tiles: "Joining the tiles",
  previews: "Drawing previews",
  bundle: "Writing the bundle",
  report: "Writing the report",
};

/**
 * Returns the state as one line, for example `Building surfaces: 3 of 10 tiles, about 40 s left`.
 *
 * @param isShown whether the page shows the newest view of the build
 */
export function wordsOf(state: BuildState, isShown: boolean): string {
  switch (state.doing) {
    case "unbuilt":
      return "";
    case "queued":
      return `Waiting for ${state.place > 1 ? "other builds" : "its build to begin"}.`;
    case "failed":
      return `The build has stopped${state.line === "" ? "" : `: ${state.line}`}. The view stays as it is.`;
    case "cancelled":
      return "The build was cancelled. Finished parts are kept.";
    case "deleted":
      return "This image was deleted, or its storage time is over. The view stays until this page is closed.";
    case "complete":
      return isShown ? "Complete: all surfaces are built." : "Built. Opening the surfaces.";
    case "paused":
      return `Paused${tilesOf(state)}.`;
    case "pausing":
      return "Pausing after the running tasks.";
    case "building":
      return `${partWords(state.label)}${tilesOf(state)}${leftWords(state.left_s)}`;
  }
}

/** Returns the name of a part of a build, such as `units`. Before the first part, the build is being planned. */
export function partWords(label: string): string {
  return PARTS[label] ?? "Planning the build";
}

function tilesOf({ tiles, allTiles, label, done, total }: BuildState): string {
  if (label === "units") return `: ${tiles} of ${allTiles} ${allTiles === 1 ? "tile" : "tiles"}`;
  return total > 1 ? `: ${done} of ${total}` : "";
}

/** Returns the remaining time, for example `, about 40 s left`; empty if unknown. */
export function leftWords(left_s: number | null): string {
  if (left_s === null) return "";
  if (left_s < 90) return `, about ${Math.max(5, Math.ceil(left_s / 5) * 5)} s left`;
  if (left_s < 5400) return `, about ${Math.round(left_s / 60)} min left`;
  return `, about ${Math.round(left_s / 3600)} h left`;
}
