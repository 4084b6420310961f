/**
 * Explanations of choices: the visible result of each. The explanation of the setting itself is in
 * its row. This module is a separate bundle, which is loaded when a user first asks. Pure.
 */
import { PRESET_SENTENCES } from "../bundle/generated/preset_sentences";
import { OWN } from "../state/transfer_functions_2d";

/** Explanations of choices, by the last part of the control's id and the choice. */
export const CHOICES: Readonly<Record<string, Readonly<Record<string, string>>>> = {
  mode: {
    disc: "Surfaces from afar. From near, a round window in the middle shows the volume.",
    tile: "Surfaces from afar. From near, the selected tile, or the tile in the gaze, shows its volume.",
    all: "Translucent volumes in every tile, from any distance.",
    stage: "Each tile as the stage specifies: surface, volume or both.",
    traced:
      "Path tracing: volumes with soft shadows, as in a photograph. The image gets clearer while the view rests.",
    off: "Only surfaces, which are drawn fastest.",
  },
  compositing: {
    over: "Structures in front partly hide those behind them.",
    maximum: "The brightest value along each line of sight: a maximum intensity projection.",
    sum: "The sum of all values along each line of sight, as in an X-ray image.",
  },
  "transfer-function": {
    ...PRESET_SENTENCES,
    [OWN]: "The shapes that you drew in the joint histogram of value and gradient.",
  },
  tool: {
    select:
      "A tap opens a card that names the structure, with buttons to hide, recolour or isolate it.",
    measure: "A tap adds a point to a length, an angle or a line.",
  },
  "measure-kind": {
    distance: "The length between two points.",
    angle: "The angle at the second of three points.",
    line: "The length of a line through several points.",
  },
  quality: {
    auto: "Draws as finely as this device can smoothly.",
    low: "Coarse, for slow devices.",
    high: "As fine as possible, even if slow.",
  },
};

/** Explanation of a transfer function that the author of the bundle has named. */
const OF_THE_BUNDLE = "A transfer function that came with this bundle.";

const lastPart = (id: string) => id.slice(id.lastIndexOf("/") + 1);

/** Returns the explanation of a choice; "" if it needs none. */
export function explanationOfChoice(id: string, value: string): string {
  const part = lastPart(id);
  if (part !== "transfer-function") return CHOICES[part]?.[value] ?? "";
  const text = CHOICES[part][value];
  if (text === undefined) return OF_THE_BUNDLE;
  return value === OWN ? text : `${text} Its name in the stage is "${value}".`;
}
