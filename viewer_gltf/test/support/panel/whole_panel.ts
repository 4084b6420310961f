/** The panel and the keys with those of all parts, as the whole viewer has them. */
import { MEASURE_KEYS, measureSections } from "../../../src/annotations/section";
import { SAVE_KEYS, saveSections } from "../../../src/capture/section";
import { CHANNEL_KEYS } from "../../../src/channels/keys";
import {
  PAGE as CHANNELS_OF_A_PAGE,
  type ChannelFacts,
  channelSections,
} from "../../../src/channels/section";
import { labelMapSections, OBJECT_KEYS } from "../../../src/objects/label_maps";
import type { Layout, PanelView, Section } from "../../../src/panel/controls";
import { KeyTable, OWN_KEYS } from "../../../src/panel/keys";
import { layOut as layOutOwn, type Facts as OwnFacts } from "../../../src/panel/layout";
import { LIGHT_KEYS } from "../../../src/pathtrace/keys";
import { lightSections } from "../../../src/pathtrace/section";
import { SLICE_KEYS } from "../../../src/slices/keys";
import { sliceSections } from "../../../src/slices/section";
import type { ViewerState } from "../../../src/state/viewer_state";
import { STEREO_KEYS } from "../../../src/stereo/keys";
import { type StereoFacts, stereoSections } from "../../../src/stereo/section";
import { TILE_KEYS } from "../../../src/tiles/keys";
import { tileSections } from "../../../src/tiles/section";
import { VOLUME_KEYS } from "../../../src/volumes/keys";
import { volumeSections } from "../../../src/volumes/section";

export { CHANNELS_OF_A_PAGE };

export const KEYS = new KeyTable([
  ...OWN_KEYS,
  ...[...MEASURE_KEYS, ...OBJECT_KEYS, ...SLICE_KEYS, ...SAVE_KEYS],
  ...[...CHANNEL_KEYS, ...LIGHT_KEYS, ...STEREO_KEYS, ...TILE_KEYS, ...VOLUME_KEYS],
]);

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

export function layOut(state: ViewerState, facts: Facts, view: PanelView): Layout {
  const { values = [], sliceValues = [], isPatient = false, isFilming = false } = facts;
  const made = new Map((facts.objects ?? []).map(({ id, items }) => [id, items]));
  return layOutOwn(state, facts, view, [
    ...measureSections(state, values),
    ...saveSections(state, isFilming),
    ...labelMapSections(state, made, facts.isStereo),
    ...channelSections(state, facts, view),
    ...volumeSections(state, facts.discLimit_deg ?? null),
    ...tileSections(state, facts.focusTile),
    ...stereoSections(state, facts, view),
    ...lightSections(state, view, facts.isStereo),
    ...sliceSections(state, sliceValues, isPatient && !facts.isStereo),
  ]);
}
