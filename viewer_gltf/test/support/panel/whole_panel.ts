/** The panel and the keys with those of all parts, as the whole viewer has them. */
import { MEASURE_KEYS, measureSections } from "../../../src/annotations/section";
import { SAVE_KEYS, saveSections } from "../../../src/capture/section";
import { labelMapSections, OBJECT_KEYS } from "../../../src/objects/label_maps";
import type { Layout, PanelView, Section } from "../../../src/panel/controls";
import { KeyTable, OWN_KEYS } from "../../../src/panel/keys";
import { layOut as layOutOwn, type Facts as OwnFacts } from "../../../src/panel/layout";
import { SLICE_KEYS } from "../../../src/slices/keys";
import { sliceSections } from "../../../src/slices/section";
import type { ViewerState } from "../../../src/state/viewer_state";

export const KEYS = new KeyTable([
  ...OWN_KEYS,
  ...[...MEASURE_KEYS, ...OBJECT_KEYS, ...SLICE_KEYS, ...SAVE_KEYS],
]);

/** What is known beside the state, by the panel and by the parts. */
export type Facts = OwnFacts &
  Readonly<{
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
    ...sliceSections(state, sliceValues, isPatient && !facts.isStereo),
  ]);
}
