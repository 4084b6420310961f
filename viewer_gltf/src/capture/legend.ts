/** Makes the legend of a saved image: name, colour and window of each shown channel. Pure. */

import type { Manifest } from "../bundle/generated/bundle";
import type { ColorLegend } from "../host/services";
import { toHex } from "../math/color";
import { unitOf, valueText } from "../probe/measure";
import type { ViewerState } from "../state/viewer_state";
import type { LegendEntry } from "./caption";

/** @param colorsOf returns the meaning of the objects' colours; null if they have the colour of the channel or stage */
export function legendOf(
  state: ViewerState,
  manifest: Manifest,
  colorsOf: (channel: string) => ColorLegend | null,
): readonly LegendEntry[] {
  return state.channels.flatMap(({ id, name, shown, color, window }): LegendEntry[] => {
    const found = manifest.channels.find((channel) => channel.id === id);
    if (!shown || found === undefined) return [];
    const dot = [toHex(color)];
    if (found.objects !== undefined) {
      const legend = colorsOf(id);
      // The values of a label map are names of objects, so that a window has no meaning.
      if (legend === null) return [{ name, colors: dot, text: "" }];
      const rows = legend.rows.map((row) => ({ name: "", ...row }));
      return [{ name, colors: [], text: `by ${legend.column}` }, ...rows];
    }
    const range = found.window;
    const at = (share: number) => valueText(range[0] + share * (range[1] - range[0]), range);
    const text = `${at(window[0])} – ${at(window[1])} ${unitOf(manifest)}`.trim();
    return [{ name, colors: dot, text }];
  });
}
