/** The keys of cutting, of sharing and of the panel itself. Pure. */

import { groupNotices } from "../state/notice_groups";
import { REFUSED } from "../state/refusals";
import { chosenClipPart, clipPartName, clipPartsOf, moveClipPart } from "./clip_by_key";
import { type Key, key, neighbour, no } from "./key";
import { middleBox, middlePlane } from "./layout";

const NOT_CUT = no(REFUSED.cut);

function nextClipPart(by: number): Key["to"] {
  return ({ state: { clip }, view }) => {
    const clipPart = neighbour(clipPartsOf(clip), view.clipPart ?? undefined, by);
    return clipPart === null ? NOT_CUT : { panel: "clip-part", clipPart };
  };
}

function push(steps: number): Key["to"] {
  return ({ state: { clip }, view, shown }) => {
    const clipPart = chosenClipPart(clip, view.clipPart);
    if (clipPart === undefined) return NOT_CUT;
    return (
      moveClipPart(clipPart, steps, clip, shown) ?? no(`${clipPartName(clipPart)}: at its limit.`)
    );
  };
}

export const TOOL_KEYS: readonly Key[] = [
  key("Enter", "Tap in the middle of the view", "press"),
  key("b", "Cut by a box: on or off", ({ state: { clip }, shown }) => ({
    type: "set-clip",
    clip: { ...clip, box: clip.box === null ? middleBox(shown) : null },
  })),
  key("n", "Cut by a plane: on or off", ({ state: { clip }, shown }) => ({
    type: "set-clip",
    clip: { ...clip, plane: clip.plane === null ? middlePlane(shown) : null },
  })),
  key("N", "Next part of the cuts: a face, the plane, its rotation", nextClipPart(1)),
  key("B", "Previous part of the cuts", nextClipPart(-1)),
  key(",", "Move or turn the chosen part of the cuts backwards", push(-1)),
  key(".", "Move or turn the chosen part of the cuts forwards", push(1)),
  key("l", "Copy a link to this view", "share"),
  key("Delete", "Dismiss the newest notice", ({ state }) => {
    const newest = groupNotices(state.notices).at(-1);
    return newest === undefined ? no(REFUSED.notice) : { type: "dismiss", texts: newest.of };
  }),
  key("R", "Load the failed files again", ({ state }) =>
    state.retryable.length === 0 ? no(REFUSED.failed) : "retry",
  ),
  key("h", "Hide or show the panel", { panel: "hide" }),
  key("?", "List of all keys", { panel: "help" }),
];
