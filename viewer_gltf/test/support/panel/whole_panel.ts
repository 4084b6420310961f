/**
 * The panel with the sections of all parts, as the whole viewer has it. It takes no part as a whole: pages of tests have
 * it, too.
 */
import { measureSections } from "../../../src/annotations/section";
import { saveSections } from "../../../src/capture/section";
import { CAPTURE_SETTINGS } from "../../../src/capture/settings";
import {
  PAGE as CHANNELS_OF_A_PAGE,
  type ChannelFacts,
  channelSections,
} from "../../../src/channels/section";
import { labelMapSections } from "../../../src/objects/label_maps";
import type { Layout, PanelView, Section } from "../../../src/panel/controls";
import { buildPanel as buildOwnPanel, type Facts as OwnFacts } from "../../../src/panel/layout";
import { lightSections } from "../../../src/pathtrace/section";
import { sliceSections } from "../../../src/slices/section";
import { SLICE_SETTINGS } from "../../../src/slices/settings";
import { addSettings } from "../../../src/state/part_settings";
import type { ViewerState } from "../../../src/state/viewer_state";
import { type StereoFacts, stereoSections } from "../../../src/stereo/section";
import { tileSections } from "../../../src/tiles/section";
import { volumeSections } from "../../../src/volumes/section";

export { CHANNELS_OF_A_PAGE };

addSettings("capture", CAPTURE_SETTINGS);
addSettings("slices", SLICE_SETTINGS);

/** What is known beside the state, by the panel and by the parts. */
export type Facts = OwnFacts &
  ChannelFacts &
  StereoFacts &
  Readonly<{
    /** The tile that is looked at. */
    focusTile: string | null;
    /** Where the limit of tiles in the disc ends it; null or absent: it covers no more. */
    discLimit_deg?: number | null;
    /** Of each measured point: the channels' values there. */
    values?: readonly (readonly string[])[];
    /** The channels' values where the slices meet. */
    sliceValues?: readonly string[];
    isPatient?: boolean;
    isFilming?: boolean;
    /** The label maps whose tables have come. */
    objects?: readonly Readonly<{ id: string; items: Section["items"] }>[];
  }>;

export function buildPanel(state: ViewerState, facts: Facts, view: PanelView): Layout {
  const { values = [], sliceValues = [], isPatient = false, isFilming = false } = facts;
  const made = new Map((facts.objects ?? []).map(({ id, items }) => [id, items]));
  return buildOwnPanel(state, facts, view, [
    ...measureSections(state, values),
    ...saveSections(state, isFilming, 0),
    ...labelMapSections(state, made, facts.isStereo),
    ...channelSections(state, facts, view),
    ...volumeSections(state, facts.discLimit_deg ?? null),
    ...tileSections(state, facts.focusTile),
    ...stereoSections(state, facts, view),
    ...lightSections(state, view, facts.isStereo),
    ...sliceSections(state, sliceValues, isPatient && !facts.isStereo),
  ]);
}
