/** The panel's section for images and videos, and its keys. Pure. */

import { command, controlsOf } from "../panel/control_templates";
import type { Control, PartSection } from "../panel/controls";
import { type Key, type KeyGroup, key, keysOf, no } from "../panel/key";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import { PICTURE_SIZE } from "./settings";

function saveItems(state: ViewerState, isFilming: boolean, next: number): readonly Control[] {
  const { length } = state.keptViews;
  const name = length === 0 ? undefined : state.keptViews[next % length].name;
  const path = length > 1 ? `through ${length} views` : "once around";
  const none = length === 0 ? REFUSED.views : "";
  return [
    ...controlsOf([PICTURE_SIZE], state),
    command("save-picture", isFilming ? "Cancel" : "Save the picture"),
    command("save-video", isFilming ? "Cancel" : `Save a video, ${path}`),
    command("keep-view", length === 0 ? "Keep this view" : `Keep this view (${length} kept)`),
    {
      ...command("next-view", name === undefined ? "Next kept view" : `Next kept view: ${name}`),
      refusal: none,
    },
    { ...command("forget-views", "Remove the kept views"), refusal: none },
  ];
}

export const SAVE_COMMANDS = [
  /**
   * Saves an image of the view in the chosen size. Using the command again meanwhile cancels the
   * image.
   */
  "save-picture",
  /**
   * Saves a video once around the specimen, or through the kept views. Using the command again
   * meanwhile cancels the video.
   */
  "save-video",
  "keep-view",
  "next-view",
  "forget-views",
] as const;

declare module "../state/commands" {
  interface CommandNames extends Record<(typeof SAVE_COMMANDS)[number], true> {}
}

/** @param next index of the kept view that is shown next */
export function saveSections(
  state: ViewerState,
  isFilming: boolean,
  next: number,
): readonly PartSection[] {
  const items = saveItems(state, isFilming, next);
  return [{ id: "save", label: "Pictures and video", rank: 70, items }];
}

const NO_VIEW = no(REFUSED.views);

const KEYS: readonly Key[] = [
  ...keysOf(PICTURE_SIZE),
  key('"', "Save the picture, or cancel saving", "save-picture"),
  key(")", "Save a video once around or through the kept views, or cancel it", "save-video"),
  key("'", "Keep this view for a video", "keep-view"),
  key("`", "Next kept view", ({ state }) => (state.keptViews.length === 0 ? NO_VIEW : "next-view")),
  key("End", "Remove the kept views", ({ state }) =>
    state.keptViews.length === 0 ? NO_VIEW : "forget-views",
  ),
];

export const SAVE_KEYS: readonly KeyGroup[] = [
  { name: "Pictures and video", rank: 90, keys: KEYS },
];
