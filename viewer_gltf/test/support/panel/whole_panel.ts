/**
 * The panel with the sections of all parts, as in the whole viewer. It imports only the sections
 * and not the parts, because pages of tests use it, too.
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

/** Inputs of the panel and of the sections of the parts that are not in the state. */
export type Facts = OwnFacts &
  ChannelFacts &
  StereoFacts &
  Readonly<{
    /** The gazed tile. */
    focusTile: string | null;
    /** Radius at which the limit of tiles ends the focus disc; null or absent: it covers fewer tiles. */
    discLimit_deg?: number | null;
    /** For each measured point, the values of the channels. */
    values?: readonly (readonly string[])[];
    /** Values of the channels where the slices meet. */
    sliceValues?: readonly string[];
    isPatient?: boolean;
    isFilming?: boolean;
    /** The label maps whose tables are loaded. */
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
