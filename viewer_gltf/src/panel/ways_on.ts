/** What leads on from a refusal: the button beside its sentence. Pure. */
import type { Box } from "../math/box";
import { setTo } from "../state/parameters/kinds";
import { TRACED_ALONE } from "../state/parameters/light";
import { TOOL } from "../state/parameters/tools";
import { COMPOSITING, MODE, type Mode } from "../state/parameters/volumes";
import { REFUSED } from "../state/refusals";
import { tileName } from "../state/tile_name";
import type { ViewerState } from "../state/viewer_state";
import type { Offer } from "./controls";
import { middlePlane } from "./layout";

export type WayOn = Readonly<{
  state: ViewerState;
  /** The specimen, or the tile that is shown alone, um. */
  shown: Box;
  /** Rows of the objects that show, by channel. */
  objects: ReadonlyMap<string, readonly number[]>;
}>;

const mode = (label: string, value: Mode) => (): Offer => ({ label, to: [setTo(MODE, value)] });
const EVERYWHERE = mode("Show volumes everywhere", "all");
const measure = (): Offer => ({ label: "Measure", to: [setTo(TOOL, "measure")] });

/** Buttons by the refusal that they lead on from. */
export type WaysOn = Readonly<Record<string, (now: WayOn) => Offer>>;

const WAYS: WaysOn = {
  [REFUSED.tile]: ({ state: { middle, tiles } }) => ({
    label: `Only ${tileName(middle, tiles)}`,
    to: [{ type: "isolate", tile: middle }],
  }),
  [REFUSED.near]: mode("Show a focus disc", "disc"),
  [REFUSED.disc]: mode("Show a focus disc", "disc"),
  [REFUSED.marched]: EVERYWHERE,
  [REFUSED.shaded]: EVERYWHERE,
  [REFUSED.opacity]: () => ({ label: "Choose Opacity", to: [setTo(COMPOSITING, "over")] }),
  [TRACED_ALONE]: mode("Show natural light", "traced"),
  [REFUSED.measuring]: measure,
  [REFUSED.measured]: measure,
  [REFUSED.cut]: ({ state: { clip }, shown }) => ({
    label: "Cut by a plane",
    to: [{ type: "set-clip", clip: { ...clip, plane: middlePlane(shown) } }],
  }),
  [REFUSED.objects]: ({ objects }) => ({
    label: "Select all that show",
    to: [...objects].map(([channel, selected]) => ({
      ...{ type: "objects", channel, change: { selected } },
    })),
  }),
};

/** @param ofParts those of the parts; null: nothing leads on but what the sentence says */
export function offerFor(refusal: string, now: WayOn, ofParts: WaysOn = {}): Offer | null {
  return (WAYS[refusal] ?? ofParts[refusal])?.(now) ?? null;
}
