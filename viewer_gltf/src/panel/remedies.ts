/** Buttons beside refusals, each with the actions that solve the problem. Pure. */
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

export type RemedyContext = Readonly<{
  state: ViewerState;
  /** Bounds of the specimen or the isolated tile, um. */
  shown: Box;
  /** By channel, the numbers of the shown objects' rows in the table of objects. */
  objects: ReadonlyMap<string, readonly number[]>;
}>;

const mode = (label: string, value: Mode) => (): Offer => ({ label, to: [setTo(MODE, value)] });
const EVERYWHERE = mode("Show volumes everywhere", "all");
const measure = (): Offer => ({ label: "Measure", to: [setTo(TOOL, "measure")] });

/** Buttons by the refusal that they solve. */
export type Remedies = Readonly<Record<string, (now: RemedyContext) => Offer>>;

const REMEDIES: Remedies = {
  [REFUSED.tile]: ({ state: { middle, tiles } }) => ({
    label: `Show only ${tileName(middle, tiles)}`,
    to: [{ type: "isolate", tile: middle }],
  }),
  [REFUSED.near]: mode("Show a focus disc", "disc"),
  [REFUSED.disc]: mode("Show a focus disc", "disc"),
  [REFUSED.marched]: EVERYWHERE,
  [REFUSED.shaded]: EVERYWHERE,
  [REFUSED.opacity]: () => ({ label: "Choose Opacity", to: [setTo(COMPOSITING, "over")] }),
  [TRACED_ALONE]: mode("Show volumes in natural light", "traced"),
  [REFUSED.measuring]: measure,
  [REFUSED.measured]: measure,
  [REFUSED.cut]: ({ state: { clip }, shown }) => ({
    label: "Cut by a plane",
    to: [{ type: "set-clip", clip: { ...clip, plane: middlePlane(shown) } }],
  }),
  [REFUSED.objects]: ({ objects }) => ({
    label: "Select all shown objects",
    to: [...objects].map(([channel, selected]) => ({
      ...{ type: "objects", channel, change: { selected } },
    })),
  }),
};

/** @param ofParts buttons of the parts @returns null: the refusal has no button */
export function offerFor(
  refusal: string,
  now: RemedyContext,
  ofParts: Remedies = {},
): Offer | null {
  return (REMEDIES[refusal] ?? ofParts[refusal])?.(now) ?? null;
}
