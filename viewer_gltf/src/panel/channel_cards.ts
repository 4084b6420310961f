/** Chooses the channels that have a card above the list, if there are many. Pure. */
import type { ViewerState } from "../state/viewer_state";
import type { PanelView } from "./controls";

/**
 * Gives a card to each shown channel. The set of channels with a card stays the same until the
 * section is opened again.
 */
export function keepPlaces(view: PanelView, { channels }: ViewerState): PanelView {
  if (view.channelsWithCard !== null) return view;
  return { ...view, channelsWithCard: channels.filter(({ shown }) => shown).map(({ id }) => id) };
}
