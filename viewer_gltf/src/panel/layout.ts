/** Builds the content of the panel for a state (see controls.ts). Pure. */
import type { Box } from "../math/box";
import type { ClipPlane } from "../math/clip";
import { groupNotices } from "../state/notice_groups";
import { QUALITY_PARAMETERS } from "../state/parameters/tools";
import { ENOUGH_SAMPLES } from "../state/path_trace_settings";
import type { QualitySettings } from "../state/quality_controller";
import { REFUSED } from "../state/refusals";
import { tileName } from "../state/tile_name";
import type { ViewerState } from "../state/viewer_state";
import { command, controlsOf } from "./control_templates";
import type { Control, Layout, PanelView, PartSection, Section } from "./controls";

/** Inputs of the panel that are not in the state. */
export type Facts = Readonly<{
  title: string;
  subtitle: string;
  /** Bounds of the specimen or the isolated tile, um, world. */
  shown: Box;
  isStereo: boolean;
  /** Time between two frames of a motion, ms; null: not known yet. */
  frame_ms: number | null;
  settings: QualitySettings | null;
  triangles: number;
  /**
   * Finest resolution level (mip level) of the volumes on screen, where 0 is full resolution; null:
   * no volume is on screen.
   */
  volumeLevel: number | null;
  /** Samples per pixel of the path-traced image; null: path tracing is off. */
  samples: number | null;
  isLoading: boolean;
  /** Names of the steps that undo and redo would take; null: none. */
  undo: string | null;
  redo: string | null;
}>;

/** Largest number of notices on the panel; the newest are enough. */
const MAX_NOTICES = 3;

/** Returns the middle half of a box along each axis. Such a cut is visible at once from every side. */
export function middleBox({ min, max }: Box): Box {
  const at = (i: 0 | 1 | 2, share: number) => min[i] + share * (max[i] - min[i]);
  return {
    min: [at(0, 0.25), at(1, 0.25), at(2, 0.25)],
    max: [at(0, 0.75), at(1, 0.75), at(2, 0.75)],
  };
}

/** Returns the plane through the middle of a box that cuts away the half towards the viewer. */
export function middlePlane({ min, max }: Box): ClipPlane {
  return { normal: [0, 0, 1], offset_um: (min[2] + max[2]) / 2 };
}

/** Id of the section that lists the deeper sections. */
export const MORE = "more";

/**
 * Builds the whole panel. A flat screen lists the most used sections first, and the others under
 * *More*.
 *
 * @param contributed the sections of the parts
 */
export function buildPanel(
  state: ViewerState,
  facts: Facts,
  view: PanelView,
  contributed: readonly PartSection[],
): Layout {
  const sections = [...ownSections(state, facts, view), ...contributed]
    .filter(({ items }) => items.length > 0)
    .toSorted((a, b) => placeOf(a) - placeOf(b))
    .map(({ id, label, items, isDeeper = false }): Section => {
      const opener = { panel: "unfold", section: id } as const;
      return { id, label, items, isDeeper, isOpen: view.open.includes(id), opener };
    });
  return {
    title: facts.title,
    subtitle: facts.subtitle,
    isHidden: view.isHidden,
    sections,
    more: { isOpen: view.open.includes(MORE), opener: { panel: "unfold", section: MORE } },
    status: statusOf(state, facts),
  };
}

const DEEPER_FROM = 1000;

function placeOf({ rank, isDeeper }: PartSection): number {
  return isDeeper ? DEEPER_FROM + rank : rank;
}

/** Returns the id of the section of a label map, if `count` label maps are shown. */
export function objectsSection(channel: string, count: number): string {
  return count === 1 ? "objects" : `objects/${channel}`;
}

export const labelMapsOf = ({ channels }: ViewerState) =>
  channels.filter(({ shown, hasObjects }) => shown && hasObjects);

/** Returns the panel's own sections, which no part of the viewer contributes. */
function ownSections(state: ViewerState, facts: Facts, view: PanelView): readonly PartSection[] {
  const { isStereo } = facts;
  const about = aboutItems(facts);
  // in stereo a page of texts alone would have no target for a gaze
  const quality = [...controlsOf(QUALITY_PARAMETERS, state), ...(isStereo ? about : [])];
  const isDeeper = true;
  return [
    { rank: 0, id: "notices", label: "Notices", items: isStereo ? noticeItems(state) : [] },
    { rank: 50, id: "cut", label: "Cut open", items: cutItems(state, facts.shown) },
    { rank: 10, id: "view", label: "View", isDeeper, items: viewItems(facts) },
    { rank: 60, id: "share", label: "Share and keys", isDeeper, items: shareItems(facts, view) },
    { rank: 70, id: "quality", label: "Quality", isDeeper, items: quality },
    { rank: 80, id: "about", label: "About this view", isDeeper, items: isStereo ? [] : about },
  ];
}

function viewItems(facts: Facts): readonly Control[] {
  return [
    command("front", "Front"),
    command("side", "Side"),
    command("top", "Top"),
    command("reset", "Reset"),
    ...historyItems(facts),
  ];
}

function shareItems({ isStereo }: Facts, view: PanelView): readonly Control[] {
  return [
    command("share", "Copy a link to this view"),
    ...(view.link === ""
      ? []
      : [{ kind: "link", id: "link", label: "Link", value: view.link } as const]),
    { kind: "button", id: "help", label: "All keys (?)", to: () => ({ panel: "help" }) },
    ...(isStereo ? [] : [lettersToggle(view)]),
  ];
}

/** Switches off keys of one character, for users who speak to their computer or press keys by accident. */
function lettersToggle({ hasLetters: value }: PanelView): Control {
  return {
    kind: "toggle",
    id: "letters",
    label: "Single-character keys",
    about: "If this is off, only ?, the arrow keys, Escape and keys with Ctrl work.",
    value,
    to: (areOn) => ({ panel: "letters", areOn }),
  };
}

function historyItems({ undo, redo }: Facts): readonly Control[] {
  return [
    {
      ...command("undo", "Undo"),
      isStep: true,
      name: `Undo ${undo ?? ""}`.trim(),
      refusal: undo === null ? REFUSED.undo : "",
    },
    {
      ...command("redo", "Redo"),
      isStep: true,
      name: `Redo ${redo ?? ""}`.trim(),
      refusal: redo === null ? REFUSED.redo : "",
    },
  ];
}

/** Notices lie over the view on a flat screen; in stereo only the panel can show them. */
function noticeItems({ notices, retryable }: ViewerState): readonly Control[] {
  if (notices.length === 0) return [];
  const groups = groupNotices(notices).slice(-MAX_NOTICES);
  const items = groups.flatMap(({ text, of }, i): Control[] => [
    { kind: "text", id: `notice-${i}`, label: "Notice", value: text },
    {
      kind: "button",
      id: `dismiss-${i}`,
      label: "Dismiss",
      to: () => ({ type: "dismiss", texts: of }),
    },
  ]);
  return retryable.length > 0 ? [...items, command("retry", "Try again")] : items;
}

function cutItems({ clip }: ViewerState, shown: Box): readonly Control[] {
  return [
    {
      kind: "toggle",
      id: "clip-box",
      label: "Box",
      name: "Cut by a box",
      value: clip.box !== null,
      to: (value) => ({
        type: "set-clip",
        clip: { ...clip, box: value ? middleBox(shown) : null },
      }),
    },
    {
      kind: "toggle",
      id: "clip-plane",
      label: "Plane",
      name: "Cut by a plane",
      value: clip.plane !== null,
      to: (value) => ({
        type: "set-clip",
        clip: { ...clip, plane: value ? middlePlane(shown) : null },
      }),
    },
  ];
}

/** Returns the texts that report in which detail and at which frame rate this device draws. */
function aboutItems(facts: Facts): readonly Control[] {
  const { settings, frame_ms, triangles, volumeLevel } = facts;
  const items: Control[] = [
    {
      kind: "text",
      id: "frame-time",
      label: "Frame",
      value: frameText(frame_ms) || "not measured yet",
    },
    { kind: "text", id: "triangles", label: "Surfaces", value: trianglesText(triangles) },
    {
      kind: "text",
      id: "volume-detail",
      label: "Volumes",
      value: volumeLevel === null ? "none" : volumesText(volumeLevel),
    },
  ];
  if (settings !== null) {
    const { steps, resolution, errorFactor } = settings;
    const parts = [`${steps} steps per ray`, `${Math.round(100 * resolution)} % resolution`];
    if (errorFactor !== 1) parts.push(`${errorFactor} x coarser surfaces`);
    items.push({ kind: "text", id: "settings", label: "Rays", value: parts.join(", ") });
  }
  return items;
}

function frameText(frame_ms: number | null): string {
  return frame_ms === null ? "" : `${frame_ms.toFixed(frame_ms < 10 ? 1 : 0)} ms`;
}

/** Returns the progress of a path-traced image, in whole samples. */
function samplesText(samples: number): string {
  const whole = Math.floor(samples);
  if (whole < 1) return "gathering light …";
  if (whole >= ENOUGH_SAMPLES) return `all ${ENOUGH_SAMPLES} samples of light`;
  return `${whole} of ${ENOUGH_SAMPLES} samples of light`;
}

function trianglesText(triangles: number): string {
  if (triangles === 0) return "none";
  if (triangles < 1000) return `${triangles} triangles`;
  return `${Math.round(triangles / 1000).toLocaleString("en")} k triangles`;
}

/**
 * Returns the resolution of a mip level in words. Each level has half as many voxels along an edge
 * as the one before.
 */
function volumesText(level: number): string {
  return level === 0 ? "in full detail" : `at 1/${2 ** level} detail`;
}

/**
 * Returns the status line: whether surfaces or volumes are shown, and whether they are loaded
 * completely.
 */
function statusOf({ channels, mode, isolated, tiles }: ViewerState, facts: Facts): string {
  const { samples, isLoading } = facts;
  const isUnfinished = tiles.some((tile) => tile.isUnfinished);
  if (channels.every(({ shown }) => !shown)) return "All channels are hidden";
  const alone = isolated === null ? "" : `${tileName(isolated, tiles)} alone`;
  const unfinished = tiles.some((tile) => !tile.isUnfinished) ? UNFINISHED : STATUS.all;
  const form = isUnfinished && mode !== "all" && mode !== "traced" ? unfinished : STATUS[mode];
  const parts = [channels.some(({ hasObjects }) => !hasObjects) ? form : "Objects", alone];
  if (isLoading) parts.push("loading …");
  else if (samples !== null) parts.push(samplesText(samples));
  else if (!isUnfinished) parts.push("complete");
  return parts.filter((part) => part !== "").join(" · ");
}

/** A tile whose surfaces are not built yet is shown as a volume, even by the modes that show surfaces. */
const UNFINISHED = "Volumes until all surfaces are built";

const STATUS: Readonly<Record<ViewerState["mode"], string>> = {
  disc: "Surfaces, volumes when near",
  tile: "Surfaces, one tile as volume when near",
  all: "Volumes",
  stage: "As set in the stage",
  traced: "Volumes, path tracing",
  off: "Surfaces",
};
