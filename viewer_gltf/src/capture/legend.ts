/** The shown channels, for a picture: name, colour, and the values that the window spans. Pure. */
import { unitOf, valueText } from "../annotations/measure";
import type { Manifest } from "../bundle/generated/bundle";
import { toHex } from "../math/color";
import type { ViewerState } from "../state/viewer_state";
import type { LegendEntry } from "./caption";

export function legendOf(state: ViewerState, manifest: Manifest): readonly LegendEntry[] {
  return state.channels.flatMap(({ id, name, shown, color, window }) => {
    const range = manifest.channels.find((channel) => channel.id === id)?.window;
    if (!shown || range === undefined) return [];
    const at = (share: number) => valueText(range[0] + share * (range[1] - range[0]), range);
    const text = `${at(window[0])} – ${at(window[1])} ${unitOf(manifest)}`.trim();
    return [{ name, hex: toHex(color), range: text }];
  });
}
